"""The Foxglove layout that a log carries: import it to see the run at once."""

import json


def _three_d(follow: str) -> dict:
    topics = {
        "/scene": {"visible": True},
        "/candidates": {"visible": True},
        "/scan": {"visible": True, "colorMode": "flat", "flatColor": "#ffffffcc", "pointSize": 3},
        "/belief/robot": {"visible": True, "colorMode": "flat", "flatColor": "#2060ff80", "pointSize": 2},
        "/belief/obstacles": {"visible": True, "colorMode": "flat", "flatColor": "#ff804080", "pointSize": 2},
        "/robot/truth": {"visible": False, "type": "arrow"},
        "/robot/estimate": {"visible": True, "type": "arrow", "color": "#2060ffff", "arrowScale": [0.5, 0.1, 0.1]},
    }
    camera = {
        "perspective": True,
        "distance": 14.0,
        "phi": 35.0,
        "thetaOffset": 45.0,
        "targetOffset": [2.0, 0.0, 0.0],
        "target": [0.0, 0.0, 0.0],
        "targetOrientation": [0.0, 0.0, 0.0, 1.0],
        "fovy": 45.0,
        "near": 0.1,
        "far": 500.0,
    }
    return {
        "followTf": follow,
        "followMode": "follow-position",
        "cameraState": camera,
        "scene": {"enableStats": False},
        "transforms": {"visible": False},
        "topics": topics,
        "layers": {},
        "publish": {},
        "imageMode": {},
    }


def _plot(title: str, *paths: str) -> dict:
    series = [
        {"value": path, "enabled": True, "timestampMethod": "receiveTime", "label": path.lstrip("/")} for path in paths
    ]
    return {
        "title": title,
        "paths": series,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def foxglove_layout() -> bytes:
    """A 3-D view that follows the robot, plots of its motion, estimate and timing, and the events."""
    panels = {
        "3D!room": _three_d("base_link"),
        "Plot!speed": _plot("speed [m/s]", "/robot/state.twist[0]", "/command.v", "/decision.nominal.v"),
        "Plot!turn": _plot("turn rate [rad/s]", "/robot/state.twist[1]", "/command.omega", "/decision.nominal.omega"),
        "Plot!safety": _plot("share of safe samples, cost", "/cone.safe_share", "/decision.cost.total"),
        "Plot!timing": _plot("time [ns]", "/tick.sense_ns", "/tick.estimate_ns", "/tick.control_ns", "/tick.record_ns"),
        "RosOut!events": {"searchTerms": [], "minLogLevel": 1, "topicToRender": "/events"},
        "RawMessages!decision": {"topicPath": "/decision", "expansion": "all"},
    }
    plots = {
        "direction": "column",
        "first": {"direction": "column", "first": "Plot!speed", "second": "Plot!turn"},
        "second": {"direction": "column", "first": "Plot!safety", "second": "Plot!timing"},
    }
    words = {"direction": "row", "first": "RosOut!events", "second": "RawMessages!decision", "splitPercentage": 65}
    layout = {
        "configById": panels,
        "globalVariables": {},
        "playbackConfig": {"speed": 1},
        "userNodes": {},
        "layout": {
            "direction": "row",
            "first": {"direction": "column", "first": "3D!room", "second": words, "splitPercentage": 75},
            "second": plots,
            "splitPercentage": 65,
        },
    }
    return json.dumps(layout, indent=1).encode()
