"""What the server's process takes while the load lasts: memory and processor time, once a second."""

import threading
import time
from statistics import fmean

import numpy as np
import psutil

_INTERVAL_SECONDS = 1.0


class Meter:
    """Samples a process until it is closed."""

    def __init__(self, pid: int) -> None:
        self._process = psutil.Process(pid)
        self._samples: list[tuple[float, float]] = []
        self._cpu_before = self._cpu()
        self._loop_before = self._loop()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._sample, name="meter", daemon=True)
        self._thread.start()

    def close(self) -> float:
        """End, and return the processor seconds that the process has taken since the beginning."""
        self._closed.set()
        self._thread.join()
        return self._cpu() - self._cpu_before

    @property
    def event_loop(self) -> float:
        """Processor seconds that the process's first thread, which runs the event loop, has taken since the beginning."""
        return self._loop() - self._loop_before

    @property
    def peak_megabytes(self) -> float:
        """The most memory that it had."""
        return max(memory for _, memory in self._samples)

    def second_half(self) -> tuple[float, float]:
        """Memory over the second half: the mean in megabytes, and the slope of the line through it in megabytes an hour."""
        middle = (self._samples[0][0] + self._samples[-1][0]) / 2
        half = [(moment, memory) for moment, memory in self._samples if moment >= middle]
        if len(half) < 2:
            return half[0][1], 0.0
        slope = float(np.polyfit([moment - middle for moment, _ in half], [memory for _, memory in half], 1)[0])
        return fmean(memory for _, memory in half), 3600.0 * slope

    def _sample(self) -> None:
        while True:
            self._samples.append((time.monotonic(), self._process.memory_info().rss / 2**20))
            if self._closed.wait(_INTERVAL_SECONDS):
                return

    def _cpu(self) -> float:
        times = self._process.cpu_times()
        return float(times.user + times.system)

    def _loop(self) -> float:
        return sum(
            float(thread.user_time + thread.system_time)
            for thread in self._process.threads()
            if thread.id == self._process.pid
        )
