"""Whether the machine takes all that a study may show: asked before anything is shown or rehearsed."""

from __future__ import annotations

from ...models import ModelError
from ...runtime.configuration.config import Loaded
from ...runtime.configuration.session import build, require_sound
from ...runtime.core.sections import Config
from ...runtime.errors import ConfigError
from ...runtime.live.never_active import first_press
from .protocol import Asked, Design, Machines
from .settings import StudyError
from .study_text import StudyText


def try_out(design: Design, text: StudyText, machines: Machines, simulated: bool | None) -> str:
    """The unit of what the study finds.

    Args:
        design: the study.
        text: of its file.
        machines: that it names.
        simulated: whether a simulated machine is to render it; None: where it can be simulated.

    Raises:
        StudyError: with file and line of the first thing that the machine does not take.
    """
    try:
        plain = machines("")
    except (ConfigError, ModelError) as error:
        raise text.refusal("machine", str(error)) from error
    try:
        unit = design.unit(machines)
    except StudyError as error:
        raise text.refusal(design.parameter_key, str(error)) from error
    if simulated is None:
        simulated = plain.config.simulation is not None
    for asked in design.asked:
        _try(asked, text, machines, simulated)
    return unit


def _try(asked: Asked, text: StudyText, machines: Machines, simulated: bool) -> None:
    """One stimulus, or a level between two that are built: the machine itself takes long to build."""
    try:
        loaded = asked.stimulus.machine(machines)
        if asked.outermost:
            build(loaded)
        else:
            require_sound(loaded)
    except (ConfigError, ModelError) as error:
        raise text.refusal(asked.key, f"{asked.what}the machine refuses it: {error}") from error
    except StudyError as error:
        raise text.refusal(asked.key, str(error)) from error
    _require_time(asked, text, loaded, simulated)


def _require_time(asked: Asked, text: StudyText, loaded: Loaded, simulated: bool) -> None:
    config, seconds = loaded.config, asked.stimulus.seconds
    if simulated and config.simulation is None:
        raise text.refusal("machine", f"{loaded.source} has no [simulation]; run the study with --live")
    press = first_press(config) if simulated else 0.0
    if press is None:
        problem = f"nobody presses the dead-man switch in the simulation of {loaded.source}"
        raise text.refusal("machine", f"{problem}; let simulation.hand.dead_man press it, or use --live")
    if seconds <= press + config.arming.fade:
        raise text.refusal(asked.seconds_key, _too_short(seconds, press, config, loaded.source))


def _too_short(seconds: float, press: float, config: Config, source: str) -> str:
    fade = config.arming.fade
    begun = f"the hand presses at {press:g} s and " if press else ""
    why = f"{begun}its force fades in for {fade:g} s ([arming])"
    return f"{seconds:g} s are over before {source} is active: {why}; give more than {press + fade:g}"
