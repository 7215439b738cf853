"""The report of one campaign: a self-contained page with map and charts, and the same facts as JSON and CSV."""

from gcs.report.data import MetricsRow, Provenance, ReportData
from gcs.report.render import render_page, render_report

__all__ = ["MetricsRow", "Provenance", "ReportData", "render_page", "render_report"]
