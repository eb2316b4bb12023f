"""Which vehicle flew: the search behind the paper's table, and fits to recorded flights."""

from continuair.identification.fitting import Fit, fit
from continuair.identification.recording import Recording, load_recording
from continuair.identification.search import Effort
from continuair.identification.table import identify_table

__all__ = ["Effort", "Fit", "Recording", "fit", "identify_table", "load_recording"]
