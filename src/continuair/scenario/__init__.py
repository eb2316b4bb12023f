"""Scenarios: start, inputs, targets, wind, and the task of tracking a path with a camera."""

from continuair import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from continuair.scenario.letters import LETTERS as LETTERS
    from continuair.scenario.letters import strokes as strokes
    from continuair.scenario.tracking_task import LETTER_HEIGHT as LETTER_HEIGHT
    from continuair.scenario.tracking_task import SETTINGS as SETTINGS
    from continuair.scenario.tracking_task import along_x as along_x
    from continuair.scenario.tracking_task import chosen_letters as chosen_letters
    from continuair.scenario.tracking_task import damping_notes as damping_notes
    from continuair.scenario.tracking_task import equipped as equipped
    from continuair.scenario.tracking_task import noise_notes as noise_notes
    from continuair.scenario.tracking_task import task as task
    from continuair.scenario.tracking_task import without_rotors as without_rotors

__getattr__, __dir__, __all__ = lazy.names(
    __name__,
    {
        "letters": (
            "LETTERS",
            "strokes",
        ),
        "tracking_task": (
            "LETTER_HEIGHT",
            "SETTINGS",
            "along_x",
            "chosen_letters",
            "damping_notes",
            "equipped",
            "noise_notes",
            "task",
            "without_rotors",
        ),
    },
)
