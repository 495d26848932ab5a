"""How the service answers, whatever is asked: parts of lists, tags, errors, pages; clients that leave or take for ever."""
