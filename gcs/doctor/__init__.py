"""``gcs doctor``: is this machine fit to fly from, and if not, what to do about it."""

from gcs.doctor.finding import Finding, Grade

__all__ = ["Finding", "Grade"]
