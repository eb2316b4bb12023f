"""Identification: fits of a vehicle's parameters to a recorded flight, and measured poses."""

from continuair.identification.fitting import Fit, fit
from continuair.identification.poses import Marker, StaticPoses, load_poses
from continuair.identification.recording import Recording, load_recording

__all__ = ["Fit", "Marker", "Recording", "StaticPoses", "fit", "load_poses", "load_recording"]
