"""An example for every request of the API that has a body, and for answers that one builds on: part of its description."""

import base64
from typing import Any, TypeAlias

Description: TypeAlias = dict[str, Any]

_JSON = "application/json"
_ARENA = {"name": "Lab", "width": 8.0, "height": 6.0, "circles": [{"x": 1.0, "y": 0.5, "radius": 0.3}]}
_FILE = base64.b64encode(b"format: mapless-arena/1\nname: Lab\nwidth: 8.0\nheight: 6.0\n").decode()
_LIVE = {"mode": "policy", "robots": 4, "speed": 2}
# In base64, as it would begin: an ONNX file is longer.
_ONNX = base64.b64encode(b"\x08\x08\x12\x07pytorch").decode()

BODIES: dict[str, Any] = {
    "POST /api/workers/drain": {"worker": "gpu-1@lab"},
    "POST /api/login": {"token": "the token that the server printed at start"},
    "POST /api/sign-in": {"name": "ada", "password": "correct horse battery staple"},
    "PUT /api/account/password": {"old": "correct horse battery staple", "new": "a longer sentence than before"},
    "POST /api/account/tokens": {"name": "notebook", "scope": "launch", "days": 90},
    "PATCH /api/people/{user_id}": {"admin": True},
    "PUT /api/projects/{project_id}/members/{user_id}": {"role": "editor"},
    "POST /api/invitations": {"project_id": "default", "role": "viewer", "note": "Grace, until May", "days": 7},
    "POST /api/invitations/look": {"code": "what the link ends with"},
    "POST /api/invitations/accept": {
        "code": "what the link ends with",
        "name": "grace",
        "password": "correct horse battery staple",
    },
    "POST /api/worker-tokens": {"name": "gpu-1"},
    "POST /api/sign-in/provider": {"back": "/queue"},
    "POST /api/alerts/rules": {"event": "success", "threshold": 0.95, "channel": "browser"},
    "PATCH /api/alerts/rules/{rule_id}": {"enabled": False},
    "POST /api/projects": {"name": "Corridors"},
    "PATCH /api/projects/{project_id}": {"name": "Corridors, second attempt"},
    "PUT /api/runs/{run_id}/priority": {"priority": 10},
    "PUT /api/runs/{run_id}/place": {"beside": "1c2q3w4e5r6t", "side": "before"},
    "POST /api/workers/remove": {"worker": "gpu-1@lab"},
    "POST /api/experiments": {
        "name": "Maze, longer sight",
        "seeds": [0, 1, 2, 3, 4],
        "parallel_runs": 2,
        "training": {
            "steps": 200_000,
            "task": {"arena": {"name": "maze", "difficulty": 0.5}},
            "algorithm": {"name": "ppo", "gamma": 0.995, "learning_rate": 5e-4},
        },
    },
    "PATCH /api/experiments/{experiment_id}": {"name": "Maze, baseline", "parallel_runs": 1},
    "POST /api/workbench/actions": {"action": "tag", "experiments": ["5t8s8mvrv66w"], "tag": "baseline"},
    "PUT /api/experiments/{experiment_id}/notes": {"notes": "Turns too *late* in narrow passages."},
    "POST /api/experiments/{experiment_id}/seeds": {"seeds": [5, 6, 7]},
    "PUT /api/workbench/views": {"name": "Good ones", "address": "query=success%20%3E%200.9&sort=-success"},
    "POST /api/arenas/imported": {"files": [{"name": "lab.yaml", "content": _FILE}], "keep": True},
    "POST /api/arenas/reviews": {"arena": _ARENA, "clearance": 0.2},
    "POST /api/suites": {"name": "My lab"},
    "POST /api/suites/{suite_id}/scenarios": {"sha256": "0" * 64},
    "POST /api/reproduction": {"seeds": 5, "effort": 0.01},
    "POST /api/studies": {
        "name": "Which discount?",
        "training": {"steps": 100_000},
        "settings": [{"kind": "range", "path": "algorithm.gamma", "low": 0.9, "high": 0.999}],
        "trials": 10,
    },
    "POST /api/studies/{study_id}/extend": {"trials": 5},
    "PUT /api/runs/{run_id}/live": _LIVE,
    "PUT /api/policies/{name}/live": _LIVE,
    "PUT /api/checkpoints/{checkpoint_id}/live": _LIVE,
    "POST /api/playgrounds": {"policy": {"source": "shipped", "name": "simple"}, "arena": {"name": "rooms"}},
    "PUT /api/playgrounds/{playground_id}/settings": {"speed": 0.5, "rays": True, "follow": True},
    "POST /api/playgrounds/{playground_id}/changes": {"act": "put target", "x": 1.5, "y": -0.5},
    "POST /api/playgrounds/{playground_id}/arena": {"name": "Rooms with a chair"},
    "POST /api/evaluations": {
        "policies": [{"source": "shipped", "name": "simple"}, {"source": "baseline", "name": "go-to-goal"}],
        "suites": [{"by": "name", "name": "simple-200"}],
    },
    "POST /api/uploads": {"name": "From elsewhere", "content": _ONNX, "task": {"arena": {"name": "complex"}}},
    "POST /api/uploads/shapes": {"task": {"lidar": {"rays": 60, "field_of_view": 360.0}}},
    "PUT /api/experiments/{experiment_id}/thinning": {"rule": {"last": 5, "every": 10, "best": True}},
    "PUT /api/experiments/{experiment_id}/curve-thinning": {"rule": {"points": 1_000, "after_days": 30}},
}
"""The body of each request, by method and path."""

ANSWERS: dict[str, Any] = {
    "GET /api/projects": {
        "items": [{"id": "default", "name": "Default", "created_at": 1.7e9, "experiments": 12, "role": "admin"}],
        "total": 1,
    },
    "GET /api/runs/{run_id}/metrics": {
        "series": [
            {"name": "train/return", "steps": [8_192, 16_384], "values": [-3.2, 1.75], "min": None, "max": None},
            {"name": "eval/success_rate", "steps": [16_384], "values": [0.62], "min": None, "max": None},
        ],
        "attempt": 1,
        "thinned": None,
        "since": None,
    },
    "GET /api/runs/{run_id}/events": [
        {"id": 1, "at": 1.7e9, "step": 0, "level": "info", "message": "Attempt 1 on gpu-1@lab."},
    ],
    "GET /api/runs/{run_id}/checkpoints/steps": {
        "items": [{"id": "2bn19yhqm8ap", "step": 16_384, "success": 0.62}],
        "total": 1,
    },
    "POST /api/account/tokens": {
        "id": "9k2f7d0q1m3z",
        "name": "notebook",
        "scope": "launch",
        "projects": None,
        "created_at": 1.7e9,
        "expires_at": 1.7e9 + 90 * 86_400,
        "seen_at": None,
        "token": "shown this once",
    },
    "POST /api/workbench/actions": {
        "done": ["5t8s8mvrv66w"],
        "left_out": [{"id": "e1x71c26mw1q", "reason": "It is in the trash."}],
    },
    "POST /api/projects/{project_id}/import": {
        "project_id": "default",
        "runs": [{"id": "7f3k1q9z2m4x", "experiment_id": "5t8s8mvrv66w", "outcome": "imported", "why": None}],
        "checkpoints": 3,
        "others": [{"kind": "policy", "id": "1p8c5v7b3n2m", "outcome": "there", "why": None}],
    },
}
"""What some requests are answered with where all is well, by method and path."""


def with_examples(description: Description) -> Description:
    """The description with the examples in their places; a place that is not there is left out."""
    for path, methods in description["paths"].items():
        for method, operation in methods.items():
            name = f"{method.upper()} {path}"
            if name in BODIES and _JSON in (content := operation.get("requestBody", {}).get("content", {})):
                content[_JSON]["example"] = BODIES[name]
            if name in ANSWERS:
                well = next(status for status in operation["responses"] if status.startswith("2"))
                operation["responses"][well]["content"][_JSON]["example"] = ANSWERS[name]
    return description
