"""The figures that the paper prints: Tables I, II and III, U = 2, MCL 117 dB, T = 120 (Section VII).

Figures 4 to 9 are printed as curves without numbers, so there is nothing of them here: what can be said in numbers
about them is their U = 2, 117 dB point, which is Table III's first row of each campus.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Printed(NamedTuple):
    """One row of four metrics as printed."""

    episodic_aoi: float  # kappa, slots
    data_collection_ratio: float  # psi
    user_coverage: float  # rho
    energy_ratio: float  # zeta


CAMPUSES = ("purdue", "ncsu", "kaist")

TABLE_I: Mapping[tuple[str, int, str], Printed] = MappingProxyType(
    {
        ("square", 2, "purdue"): Printed(8.964, 0.892, 0.358, 0.809),
        ("square", 3, "purdue"): Printed(6.398, 0.916, 0.369, 0.806),
        ("square", 4, "purdue"): Printed(6.403, 0.909, 0.369, 0.807),
        ("square", 5, "purdue"): Printed(6.384, 0.917, 0.371, 0.806),
        ("gaussian", 2, "purdue"): Printed(4.501, 0.949, 0.412, 0.804),
        ("gaussian", 3, "purdue"): Printed(3.400, 0.977, 0.433, 0.802),
        ("gaussian", 4, "purdue"): Printed(3.387, 0.979, 0.436, 0.802),
        ("gaussian", 5, "purdue"): Printed(3.384, 0.981, 0.437, 0.801),
        ("cosine", 2, "purdue"): Printed(6.742, 0.937, 0.402, 0.807),
        ("cosine", 3, "purdue"): Printed(5.124, 0.941, 0.409, 0.807),
        ("cosine", 4, "purdue"): Printed(5.146, 0.940, 0.408, 0.808),
        ("cosine", 5, "purdue"): Printed(5.175, 0.940, 0.408, 0.809),
        ("square", 2, "ncsu"): Printed(20.894, 0.772, 0.105, 0.821),
        ("square", 3, "ncsu"): Printed(18.547, 0.797, 0.118, 0.823),
        ("square", 4, "ncsu"): Printed(21.132, 0.753, 0.101, 0.826),
        ("square", 5, "ncsu"): Printed(22.548, 0.734, 0.099, 0.829),
        ("gaussian", 2, "ncsu"): Printed(9.667, 0.889, 0.211, 0.805),
        ("gaussian", 3, "ncsu"): Printed(7.999, 0.918, 0.227, 0.802),
        ("gaussian", 4, "ncsu"): Printed(7.795, 0.921, 0.228, 0.802),
        ("gaussian", 5, "ncsu"): Printed(7.690, 0.923, 0.228, 0.802),
        ("cosine", 2, "ncsu"): Printed(17.341, 0.801, 0.129, 0.820),
        ("cosine", 3, "ncsu"): Printed(15.365, 0.823, 0.149, 0.817),
        ("cosine", 4, "ncsu"): Printed(15.356, 0.826, 0.148, 0.817),
        ("cosine", 5, "ncsu"): Printed(16.976, 0.824, 0.148, 0.817),
        ("square", 2, "kaist"): Printed(10.579, 0.790, 0.280, 0.852),
        ("square", 3, "kaist"): Printed(8.596, 0.821, 0.298, 0.844),
        ("square", 4, "kaist"): Printed(9.215, 0.814, 0.286, 0.842),
        ("square", 5, "kaist"): Printed(8.976, 0.819, 0.295, 0.839),
        ("gaussian", 2, "kaist"): Printed(4.889, 0.962, 0.463, 0.811),
        ("gaussian", 3, "kaist"): Printed(2.748, 0.986, 0.472, 0.803),
        ("gaussian", 4, "kaist"): Printed(2.741, 0.988, 0.473, 0.802),
        ("gaussian", 5, "kaist"): Printed(2.739, 0.988, 0.475, 0.801),
        ("cosine", 2, "kaist"): Printed(8.298, 0.833, 0.368, 0.832),
        ("cosine", 3, "kaist"): Printed(6.235, 0.895, 0.389, 0.820),
        ("cosine", 4, "kaist"): Printed(6.211, 0.899, 0.389, 0.820),
        ("cosine", 5, "kaist"): Printed(6.209, 0.901, 0.393, 0.819),
    }
)
"""Table I, impact of hyperparameters: (similarity, depth N, campus)."""

TABLE_II_MS: Mapping[tuple[str, str], float] = MappingProxyType(
    {
        ("gcrl", "purdue"): 7.998,
        ("gcrl", "ncsu"): 5.677,
        ("gcrl", "kaist"): 11.003,
        ("drl-freshmcs", "purdue"): 33.866,
        ("drl-freshmcs", "ncsu"): 25.165,
        ("drl-freshmcs", "kaist"): 41.978,
        ("muzero", "purdue"): 9.867,
        ("muzero", "ncsu"): 6.993,
        ("muzero", "kaist"): 15.497,
        ("acktr", "purdue"): 15.223,
        ("acktr", "ncsu"): 11.035,
        ("acktr", "kaist"): 23.778,
        ("aoi-drqn", "purdue"): 21.999,
        ("aoi-drqn", "ncsu"): 17.097,
        ("aoi-drqn", "kaist"): 33.008,
    }
)
"""Table II, time cost of a decision in milliseconds on the authors' 112 cores (Section VII-A): (policy, campus)."""

TABLE_III: Mapping[tuple[str, str], Printed] = MappingProxyType(
    {
        ("gcrl", "purdue"): Printed(3.400, 0.977, 0.433, 0.802),
        ("w/o RGCN", "purdue"): Printed(11.547, 0.882, 0.378, 0.811),
        ("w/o pred", "purdue"): Printed(5.397, 0.946, 0.421, 0.805),
        ("w/o RGCN, pred", "purdue"): Printed(12.837, 0.878, 0.365, 0.809),
        ("gcrl", "ncsu"): Printed(7.999, 0.918, 0.227, 0.802),
        ("w/o RGCN", "ncsu"): Printed(23.578, 0.788, 0.109, 0.816),
        ("w/o pred", "ncsu"): Printed(10.991, 0.912, 0.223, 0.809),
        ("w/o RGCN, pred", "ncsu"): Printed(25.001, 0.772, 0.103, 0.820),
        ("gcrl", "kaist"): Printed(2.748, 0.986, 0.472, 0.803),
        ("w/o RGCN", "kaist"): Printed(7.385, 0.843, 0.402, 0.824),
        ("w/o pred", "kaist"): Printed(3.998, 0.971, 0.463, 0.818),
        ("w/o RGCN, pred", "kaist"): Printed(9.458, 0.799, 0.375, 0.831),
    }
)
"""Table III, ablations: (row, campus)."""

FIGURES: Mapping[tuple[str, str], int] = MappingProxyType(
    {
        ("uavs", "purdue"): 4,
        ("mcl", "purdue"): 5,
        ("uavs", "ncsu"): 6,
        ("mcl", "ncsu"): 7,
        ("uavs", "kaist"): 8,
        ("mcl", "kaist"): 9,
    }
)
"""Number of the paper's figure: (what varies, campus); Section VII-F."""
