"""The system model of the paper, written once: pure functions on NumPy or torch arrays.

Shapes are written with leading batch dimensions as ``...``; U UAVs, M users, A actions, T slots.
Positions are ``pos_enu_m`` [..., 2]: metres east and north of the area's south-west corner.
Headings are clockwise from true north in [0, 2 pi): east = v sin(heading), north = v cos(heading).
"""
