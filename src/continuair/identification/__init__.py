"""Identification: fits of a vehicle's parameters to a recorded flight."""

from continuair.identification.fitting import Fit, fit
from continuair.identification.recording import Recording, load_recording

__all__ = ["Fit", "Recording", "fit", "load_recording"]
