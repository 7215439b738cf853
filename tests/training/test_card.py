from policy.training.card import command_line, git_commit


def test_the_command_tells_no_folders_of_the_machine() -> None:
    typed = ["/usr/bin/python", "-m", "policy.training", "--out", "/home/me/runs/a", "--episodes", "3"]
    assert command_line(typed) == "python -m policy.training --out a --episodes 3"


def test_the_commit_is_a_hash_or_unknown() -> None:
    commit = git_commit()
    assert commit is None or (len(commit) == 40 and set(commit) <= set("0123456789abcdef"))
