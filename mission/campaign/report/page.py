"""`report.html`."""
from pathlib import Path
from mission.campaign.findings import Findings
REPORT_FILE = "report.html"
def write_report(findings: Findings, folder: Path) -> None:
    (folder / REPORT_FILE).write_text("")
