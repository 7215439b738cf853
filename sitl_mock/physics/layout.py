"""Rows of the motion's arrays: one row a quantity, one column a vehicle, NED metres from the pad, SI units.

A row is contiguous, so that the compiled loops take several vehicles at once; a vehicle is a column.
"""

from __future__ import annotations

from sitl_mock.physics.vehicle import PARAMETERS

BLOCK = 64  # vehicles that the kernel works on at a time: all their rows stay in the fastest cache

# State rows. ACCEL is over ground and holds for the present step; LEAN_WAS is LEAN a step ago.
POS, VEL, VEL_WISH, ACCEL_WISH, LAG, INTEGRAL, LEAN, LEAN_RATE, LEAN_WAS, ACCEL = 0, 3, 6, 9, 12, 14, 16, 18, 20, 22
YAW, USED_J, POWER_W, GUST = 25, 26, 27, 28
STATE_ROWS = 33
# Command rows: velocity NED (m/s), yaw (rad, NaN holds), motors (share of the thrust: 0 off, 1 all).
CMD_VEL, CMD_YAW, CMD_MOTORS = 0, 3, 4
COMMAND_ROWS = 5
# Where each array begins in the kernel's own buffer; WIND is what the air does, gusts included.
COMMAND = STATE_ROWS
LIMITS = COMMAND + COMMAND_ROWS
STEADY_WIND = LIMITS + len(PARAMETERS)
WIND = STEADY_WIND + 2
AIRSPEED = WIND + 3
BUFFER_ROWS = AIRSPEED + 1
