"""Every page of a made lab, and what is on it once it is whole."""

from urllib.parse import quote

from benchmarks.dashboard.data import Lab

SMALL = {"experiments": 11, "points": 60, "long_experiments": 1, "long_points": 400, "checkpoints": 12, "live": 0}
"""Sizes of a lab that has one of everything and is made in seconds."""


def addresses(lab: Lab) -> dict[str, tuple[str, str]]:
    """By the name of a page its address, and a selector that finds something once it is whole."""
    first, *_ = lab.experiments
    (long, *_) = lab.long_experiments
    return {
        "trainings": ("/", "[data-testid=experiment]"),
        "new-training": ("/new", "[data-testid=launch-summary]"),
        "training": (f"/experiments/{long}", "[data-testid=chart] canvas"),
        "run": (f"/runs/{lab.many}", "[data-testid=checkpoint]"),
        "compare": (f"/compare?experiment={first}&experiment={long}", "[data-testid=figures]"),
        "studies": ("/studies", "h1"),
        "evaluations": ("/evaluations", "h1"),
        "leaderboards": ("/leaderboards", "[data-testid=entry]"),
        "recordings": ("/recordings", "h1"),
        "policies": ("/policies", "[data-testid=policy]"),
        "policy": ("/policies/complex", "[data-testid=episode]"),
        "arenas": ("/arenas", "[data-testid=arena]"),
        "arena-editor": ("/arenas/draw?from=" + quote('{"name":"complex"}'), "[data-testid=review][data-current=true]"),
        "playground": ("/playground", "h1"),
        "paper": ("/reproduction", "[data-testid=claim]"),
        "queue": ("/queue", "h1"),
        "storage": ("/storage", "h1"),
        "alerts": ("/alerts", "h1"),
        "account": ("/account", "h1"),
        "projects": ("/projects", "h1"),
        "project": ("/projects/default", "h1"),
        "people": ("/people", "h1"),
        "audit": ("/audit", "h1"),
        "api": ("/reference", "[data-testid=operation]"),
        "join": ("/join", "h1"),
        "not-found": ("/nowhere", "h1"),
    }
