"""Alerts: what people want to hear of, noticed once and sent where they want it."""
