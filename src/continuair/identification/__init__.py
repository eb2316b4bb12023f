"""Identification: fits of a vehicle's parameters to what was measured, and comparisons with it."""

from continuair.identification.bench import Bench, load_bench
from continuair.identification.comparison import HeldOut, held_out_errors
from continuair.identification.decay import Decay, decay_of, onset
from continuair.identification.driven import DrivenMotion, load_driven
from continuair.identification.fitting import Fit, fit
from continuair.identification.joint import JointFit, fit_jointly
from continuair.identification.poses import Marker, StaticPoses, load_poses
from continuair.identification.recording import Recording, load_recording
from continuair.identification.releases import Releases, load_releases
from continuair.identification.validation import ReleaseValidation, validate_releases

__all__ = [
    "Bench",
    "Decay",
    "DrivenMotion",
    "Fit",
    "HeldOut",
    "JointFit",
    "Marker",
    "Recording",
    "ReleaseValidation",
    "Releases",
    "StaticPoses",
    "decay_of",
    "fit",
    "fit_jointly",
    "held_out_errors",
    "load_bench",
    "load_driven",
    "load_poses",
    "load_recording",
    "load_releases",
    "onset",
    "validate_releases",
]
