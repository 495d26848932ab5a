"""What is counted as it happens, for Prometheus. Every label has few values, whatever clients send."""

from prometheus_client import CollectorRegistry, Counter, GCCollector, Histogram, ProcessCollector

_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class Instruments:
    """The counters of one service. Thread-safe."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        GCCollector(registry=self.registry)
        self.requests = Histogram(
            "mapless_request_seconds",
            "Time until the answer to a request began.",
            ("method", "route", "status"),
            buckets=_SECONDS,
            registry=self.registry,
        )
        self.claims = Counter("mapless_claims", "Runs that workers took up.", ("queue",), registry=self.registry)
        self.losses = Counter(
            "mapless_losses", "Attempts that ended without the worker's last word.", registry=self.registry
        )
        self.wrong_secrets = Counter("mapless_wrong_secrets", "Wrong tokens and cookies.", registry=self.registry)
        self.ingest = Histogram(
            "mapless_ingest_lag_seconds",
            "From the arrival of a worker's report to its commit.",
            buckets=_SECONDS,
            registry=self.registry,
        )
