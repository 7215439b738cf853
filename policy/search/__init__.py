"""Look-ahead search over the world model: a beam of paths, one UAV at a time, the others' plans held fixed.

Public names::

    settings = settings_for(scenario)                    # or SearchSettings(...): policy.search.settings
    moves = make_moves(scenario, settings)               # once a campaign: policy.search.moves
    problem = make_problem(scenario, moves, state, settings, user_pos_enu_m=None)  # once a slot
    plan = make_plan(problem, incumbent=previous.shifted(), leaf=None)             # policy.search.planner

``user_pos_enu_m`` [H, M, 2] are the users' predicted places at the end of each slot of the horizon (None: they
stay). ``leaf`` scores the states at the end of the horizon in one batch (``policy.search.leaf``); None takes the
closed form "sum over users of AoI x slots needed to reach them".
"""
