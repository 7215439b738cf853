"""Vehicle motion: one vectorised model for a MAVLink vehicle and for thousands in lock step."""
