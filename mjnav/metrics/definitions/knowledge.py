"""Definitions of the figures of decisions, computing times, and the robot's knowledge of itself and of the people.

Those of its knowledge also say whether its beliefs were consistent.
"""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.metrics.definitions.outcome import HIGHER, INTEGER, LOWER, Definition

# -------------------------------------------------------------------------- decisions and computing


_NEVER_MET = "never met an obstacle"

DECISIONS: Mapping[str, Definition] = MappingProxyType(
    {
        "infeasible_ticks": Definition(
            text="ticks at which nothing met the constraints: the sum of the next two", type=INTEGER, better=LOWER
        ),
        "ticks_without_nominal": Definition(
            text="status infeasible_nominal: nothing met the constraints at the mean of the samples",
            type=INTEGER, better=LOWER,
        ),
        "ticks_without_own": Definition(
            text="status infeasible: candidates met those, none the method's own constraint", type=INTEGER, better=LOWER
        ),
        "stopped_ticks": Definition(text="ticks of status stopped", type=INTEGER),
        "clipped_ticks": Definition(
            text="ticks whose decision was beyond the robot's limits; the command within them counts", type=INTEGER
        ),
        "cautious_ticks": Definition(
            text="ticks at which the robot drove more slowly than decided, or stopped, as it did not know enough",
            type=INTEGER,
        ),
        "min_safe_share": Definition(
            text="share of the closest obstacle's samples that are safe at the chosen control, minimum over ticks",
            better=HIGHER, words="least share of safe samples", null=_NEVER_MET, equation=r"f \le 0",
        ),
        "mean_safe_share": Definition(
            text="the same, mean over ticks",
            better=HIGHER, words="mean share of safe samples", null=_NEVER_MET,
        ),
    }
)  # fmt: skip

_PHASES = MappingProxyType(
    {
        "sense": "the sensors' readings",
        "estimate": "the filters and the prediction",
        "control": "a decision of the controller",
        "record": "the record of the tick, the log included",
        "tick": "a whole tick, physics included",
    }
)
_QUANTILES = MappingProxyType(
    {"p50": "median over ticks", "p99": "99 % of ticks are below", "max": "the longest of all ticks"}
)

COMPUTING: Mapping[str, Definition] = MappingProxyType(
    {
        **{
            f"compute_ms_{phase}_{level}": Definition(
                text=f"wall time of {what}; {quantile}", unit="ms", better=LOWER, null="no ticks"
            )
            for phase, what in _PHASES.items()
            for level, quantile in _QUANTILES.items()
        },
        "real_time_factor": Definition(
            text="simulated time over wall time, from tick 0 on", better=HIGHER, null="no time passed"
        ),
        "deadline_misses": Definition(
            text="ticks that ended after the next was due; 0 where the run was not paced", type=INTEGER, better=LOWER
        ),
    }
)


# ------------------------------------------------------------------------ knowledge and consistency


_NO_KIDNAPPING = "without [faults] kidnap"
_NO_SAMPLES = "no people; all samples equal; fewer than four"
_JOANES = "Joanes and Gill (1998)"
_SKEW = r"G_1 = \frac{\sqrt{n(n-1)}}{n-2}\, m_3/m_2^{3/2}"
_NO_TRACKER = "no people, or no belief"
_EXACT = "a belief is certain of what is wrong"
_GOSPA = "Rahmathullah, Garcia-Fernandez and Svensson (2017)"
_CLEAR_MOT = "Bernardin and Stiefelhagen (2008)"
_BAR_SHALOM = "Bar-Shalom, Li and Kirubarajan (2001)"
_KONG = "Kong, Liu and Wong (1994)"
_KURTOSIS = r"G_2 + 3,\ G_2 = \frac{n-1}{(n-2)(n-3)}\left((n+1)\,g_2 + 6\right),\ g_2 = m_4/m_2^2 - 3"

KNOWLEDGE: Mapping[str, Definition] = MappingProxyType(
    {
        "localization_rmse_m": Definition(
            text="error of the robot's estimated position, root of the mean square",
            unit="m", better=LOWER, words="error of the robot's belief", null="no ticks",
            equation=r"\sqrt{\frac{1}{T}\sum_k \lvert\hat p_k - p_k\rvert^2}",
        ),
        "tracking_rmse_m": Definition(
            text="error of people's estimated positions, root of the mean square over ticks and people with a track",
            unit="m", better=LOWER, words="error of beliefs of people", null="nobody was tracked",
        ),
        "seen_tracking_rmse_m": Definition(
            text="the same of tracks that were detected in the last 0.3 s, without those of people who are hidden; "
            "where the sensor says who is who, all of them",
            unit="m", better=LOWER, words="error of beliefs of people in sight", null="nobody was tracked",
            over_all=True,
        ),
        "gospa_m": Definition(
            text="how far the set of tracks is from that of the people to be tracked: GOSPA with alpha = 2, p = 2 and "
            "c = 1 m, root of the mean square over ticks",
            unit="m", better=LOWER, words="GOSPA", null=_NO_TRACKER, source=_GOSPA, over_all=True,
            equation=r"\sqrt{\frac{1}{T}\sum_k \min_g (a_k + b_k + c_k)}",
        ),
        "gospa_localization_m": Definition(
            text="its first part, of the distances; the squares of the three parts add up to that of gospa_m",
            unit="m", better=LOWER, words="GOSPA, distances", null=_NO_TRACKER, source=_GOSPA, over_all=True,
            equation=r"a_k = \sum_{(i,j)\in g} \lvert\hat p_{kj} - p_{ki}\rvert^2",
        ),
        "gospa_missed_m": Definition(
            text="its second part, of people without a track",
            unit="m", better=LOWER, words="GOSPA, missed", null=_NO_TRACKER, source=_GOSPA, over_all=True,
            equation=r"b_k = \frac{c^2}{2}\left(n_k - \lvert g\rvert\right)",
        ),
        "gospa_false_m": Definition(
            text="its third part, of tracks that are nobody's",
            unit="m", better=LOWER, words="GOSPA, false", null=_NO_TRACKER, source=_GOSPA, over_all=True,
            equation=r"c_k = \frac{c^2}{2}\left(m_k - \lvert g\rvert\right)",
        ),
        "identity_switches": Definition(
            text="times that a person's track has another number than the track before; 0 where the sensor says who is "
            "who",
            type=INTEGER, better=LOWER, null=_NO_TRACKER, source=_CLEAR_MOT, over_all=True,
        ),
        "track_fragmentations": Definition(
            text="times that a person is tracked again after a time without a track",
            type=INTEGER, better=LOWER, null=_NO_TRACKER, source="Li, Huang and Nevatia (2009)", over_all=True,
        ),
        "false_tracks": Definition(
            text="tracks that are nobody's, mean over ticks",
            better=LOWER, words="false tracks at a time", null=_NO_TRACKER, source=_CLEAR_MOT, over_all=True,
        ),
        "tracked_share": Definition(
            text="share of the time in which people are to be tracked, summed over them, in which they have a track "
            "within 1 m",
            better=HIGHER, words="share of time with a track", null=_NO_TRACKER, source=_CLEAR_MOT, over_all=True,
        ),
        "first_track_delay_s": Definition(
            text="time from when a person is to be tracked to the first track, mean over people; who never has one "
            "counts with all of the time",
            unit="s", better=LOWER, words="delay of the first track", null=_NO_TRACKER, over_all=True,
        ),
        "robot_skew": Definition(
            text="of the robot samples' x and y that the controller got, mean over ticks and axes",
            equation=_SKEW, null=_NO_SAMPLES, source=_JOANES,
        ),
        "robot_kurtosis": Definition(
            text="of the same samples; 3 for a Gaussian", equation=_KURTOSIS, null=_NO_SAMPLES, source=_JOANES
        ),
        "people_skew": Definition(
            text="the same of people's samples, mean over people too",
            equation=_SKEW, null=_NO_SAMPLES, source=_JOANES,
        ),
        "people_kurtosis": Definition(
            text="the same of people's samples; 3 for a Gaussian",
            equation=_KURTOSIS, null=_NO_SAMPLES, source=_JOANES,
        ),
    }
)  # fmt: skip

CONSISTENCY: Mapping[str, Definition] = MappingProxyType(
    {
        "robot_nees": Definition(
            text="normalised estimation error squared of the robot's x, y and heading, mean over ticks; 3 for a "
            "consistent estimate, more where it is too sure of itself",
            words="NEES of the robot (3 is right)", null=f"no belief, or {_EXACT}", source=_BAR_SHALOM, over_all=True,
            equation=r"\frac{1}{T}\sum_k e_k^\top P_k^{-1} e_k",
        ),
        "people_nees": Definition(
            text="the same of people's x, y, vx and vy, mean over ticks and people with a track; 4 for a consistent "
            "estimate",
            words="NEES of people (4 is right)", null=f"nobody was tracked, or {_EXACT}", source=_BAR_SHALOM,
            over_all=True,
        ),
        "robot_coverage": Definition(
            text="share of ticks at which the true pose lies in the 95 % region of the belief's mean and covariance; "
            "0.95 for a consistent Gaussian estimate",
            words="coverage of the robot (0.95 is right)", null="no belief", source=_BAR_SHALOM, over_all=True,
            equation=r"e_k^\top P_k^{-1} e_k \le \chi^2_{3}(0.95)",
        ),
        "people_coverage": Definition(
            text="the same of people's x, y, vx and vy, over ticks and people with a track",
            words="coverage of people (0.95 is right)", null="nobody was tracked", source=_BAR_SHALOM, over_all=True,
            equation=r"e_k^\top P_k^{-1} e_k \le \chi^2_{4}(0.95)",
        ),
        "robot_divergences": Definition(
            text="times that the true pose lay outside of the 99.9 % region for 1 s or longer",
            type=INTEGER, better=LOWER, words="divergences of the robot's belief", over_all=True,
        ),
        "people_divergences": Definition(
            text="times that a person lay outside of the 99.9 % region of the track for 1 s or longer",
            type=INTEGER, better=LOWER, words="divergences of tracks", over_all=True,
        ),
        **{
            f"ess_{name}_{of}": Definition(
                text=f"effective sample size of {belief}, {over}", better=HIGHER, null=null, source=_KONG,
                words=f"{name} effective sample size of {of}", over_all=True,
                equation=r"\left(\sum_i w_i\right)^2 / \sum_i w_i^2" if (name, of) == ("min", "robot") else "",
            )
            for name, over in (("min", "minimum over ticks"), ("mean", "mean over ticks"))
            for of, belief, null in (
                ("robot", "the robot's belief, before resampling", "no belief"),
                ("people", "people's tracks, before resampling", "nobody was tracked"),
            )
        },
        "robot_depleted_share": Definition(
            text="share of ticks at which the effective sample size of the robot's belief is below 2 % of the number "
            "of its particles",
            better=LOWER, words="share of time depleted, robot", null="no belief", over_all=True,
        ),
        "people_depleted_share": Definition(
            text="the same of people's tracks, over ticks and people with a track",
            better=LOWER, words="share of time depleted, people", null="nobody was tracked", over_all=True,
        ),
        "recoveries": Definition(
            text="times that a filter was spread again, because its belief explained no reading for some time",
            type=INTEGER, words="recoveries of filters", over_all=True,
        ),
        "kidnappings": Definition(
            text="times that the robot was put elsewhere", type=INTEGER, null=_NO_KIDNAPPING, over_all=True
        ),
        "kidnappings_recovered": Definition(
            text="of these those after which its belief came within 0.5 m and 0.3 rad of its pose for 1 s, or to the "
            "next or the end of the run",
            type=INTEGER, better=HIGHER, null=_NO_KIDNAPPING, over_all=True,
        ),
        "kidnap_recovery_s": Definition(
            text="time from a kidnapping to that, the longest of those after which it came about",
            unit="s", better=LOWER, words="recovery after a kidnapping", null="none, or none recovered", over_all=True,
        ),
    }
)  # fmt: skip
