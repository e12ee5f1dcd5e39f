"""Texts of files and people, fit for a terminal."""

from __future__ import annotations


def printable(text: str) -> str:
    """The text without characters that would steer a terminal: they become escapes."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def beginning(text: str, most: int) -> str:
    """At most so many characters of a text, printable."""
    return printable(text if len(text) <= most else text[:most] + "...")
