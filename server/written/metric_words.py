"""Writes the words of metrics for the pages: `python -m server.written.metric_words web/src/charts/metricWords.json`."""

import json
import sys
from pathlib import Path

from server.printing.metric_words import METRIC_WORDS


def metric_words() -> str:
    """All of them as JSON, by name; what is not said of one is left out."""
    words = {name: {key: value for key, value in one._asdict().items() if value} for name, one in METRIC_WORDS.items()}
    return json.dumps(words, indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(metric_words(), encoding="utf-8")
