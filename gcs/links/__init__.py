"""MAVLink sessions: bytes in, vehicle status and verdicts out. MAVLink libraries are imported here and nowhere else
in ground control."""
