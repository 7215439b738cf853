"""The scheduling behind the table of cores, by hand."""

from sweep_estimate import estimate, length, wall_s


def test_each_job_goes_to_the_core_that_is_free_first():
    assert wall_s([3.0, 1.0, 1.0, 2.0], cores=2) == 4.0  # 3 | 1, 1, then 2 on the second: 1 + 1 + 2
    assert wall_s([3.0, 1.0, 1.0, 2.0], cores=1) == 7.0
    assert wall_s([3.0, 1.0, 1.0, 2.0], cores=256) == 3.0
    assert wall_s([], cores=2) == 0.0


def test_a_stage_waits_for_the_one_before_it():
    one, sixteen, many = estimate({"trainings": [600.0, 600.0], "campaigns": [60.0] * 20})
    assert one == ("1", "40.0 min (trainings 20.0 min, campaigns 20.0 min)", "100 %")
    assert sixteen == ("16", "12.0 min (trainings 10.0 min, campaigns 2.0 min)", "21 %")
    assert many[1].startswith("11.0 min")


def test_lengths():
    assert [length(seconds) for seconds in (9.0, 90.0, 5400.0)] == ["9 s", "1.5 min", "1.5 h"]
