"""What the work before claimed: matching in the RKHS takes less control and less time than by KL divergence."""

from mjnav.paper.contrast import Cells, claim, contrasts, each
from mjnav.paper.finding import Finding, judge

STUDIES = ("paper-one", "paper-many")
SOURCE = "Poonganam et al., RA-L 2020"
CLAIMS = (
    ("control_cost", "less control cost", "m²/s³"),
    ("mean_deviation_m", "less deviation from the way", "m"),
    ("compute_ms_control_p50", "less time to decide", "ms"),
    ("collision", "fewer collisions", ""),
)


def findings(cells: Cells) -> tuple[Finding, ...]:
    """rkhs against kld with one and with three obstacles."""
    here = each(cells, lambda cell: cell.scene in ("crossing1", "crossing3"))
    found = []
    for figure, what, unit in CLAIMS:
        for method in ("rkhs d=1", "rkhs d=3"):
            text = f"{method} takes {what} than kld"
            found.append(claim(text, SOURCE, contrasts(here, method, "kld", figure), -1, unit))
    return judge(found)
