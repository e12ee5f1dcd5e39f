"""The NASA TLX, unweighted (Hart and Staveland 1988): six scales from 0 to 100 in steps of 5."""

from __future__ import annotations

from .protocol import Column, Question

STEP = 5
ANSWERS = tuple(str(value) for value in range(0, 101, STEP))
SCALES = {
    "mental_demand": "How mentally demanding was the task? 0 very low, 100 very high",
    "physical_demand": "How physically demanding was it? 0 very low, 100 very high",
    "temporal_demand": "How hurried was the pace? 0 very low, 100 very high",
    "performance": "How successful were you in doing it? 0 perfect, 100 failure",
    "effort": "How hard did you have to work for that? 0 very low, 100 very high",
    "frustration": "How insecure, irritated or annoyed were you? 0 very low, 100 very high",
}
QUESTIONS = tuple(
    Question(name, text, ANSWERS, f"0 to 100 in steps of {STEP}, and Enter") for name, text in SCALES.items()
)
COLUMNS = {name: Column(f"NASA TLX: {text}") for name, text in SCALES.items()}
