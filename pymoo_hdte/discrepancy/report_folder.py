"""Which files a report on a discrepancy consists of."""

from __future__ import annotations

from pymoo_hdte.discrepancy.revise import MODEL_FILE, SHEET_FILE
from pymoo_hdte.reports.folder import ReportFolder

FOLDER = ReportFolder("verdict.json", optional=(MODEL_FILE, SHEET_FILE))
