"""Comparisons as one would print them: tables in LaTeX, Markdown and CSV, and a report of one file that opens offline."""
