"""Equations of the paper in the paper's coordinates, in plain NumPy.

q = [x y z φ θ ψ κ ψa], with (κ, ψa) of every section where there are several, arm by arm from the
base out. The functions are slow and literal. They share no code with the fast kernels, and tests
compare the kernels with them. Source throughout: Amiri, Sepahvand, Mantegh, Janabi-Sharifi, arXiv
2602.18684; several sections and arms compose the paper's section. Every function of q also accepts
complex q, which the Christoffel symbols need for differentiation by complex steps.
"""

from continuair.equations.appendix import appendix_b, integrated_coupling
from continuair.equations.arc import arc_jacobian, arc_position, arc_rotation
from continuair.equations.camera import (
    facing,
    in_view,
    interaction_matrix,
    project,
    to_normalised,
    to_pixels,
)
from continuair.equations.dynamics import (
    MASKS,
    check_without_drag,
    coriolis_matrix,
    damping_vector,
    elastic_vector,
    forward_dynamics,
    gravity_vector,
    kinetic_energy,
    masks,
    potential_energy,
)
from continuair.equations.image import (
    camera_jacobian,
    camera_pose,
    image_jacobian,
    look,
    printed_image_jacobian,
)
from continuair.equations.kinematics import (
    arm_jacobian,
    arm_position,
    columns_of,
    euler_rate_matrix,
    jacobian,
    position,
    rotation,
    section_rotation,
    skew,
    tip_of,
)
from continuair.equations.masses import mass_matrix, slices, weight_vector
from continuair.equations.regular import accelerations
from continuair.equations.rods import rod_accelerations
from continuair.equations.servoing import kinematic_servoing, rigid_motion
from continuair.equations.strain import rod_curve, strain_of
from continuair.equations.tendons import tendon_lengths
from continuair.equations.turns import euler_angles

__all__ = [
    "MASKS",
    "accelerations",
    "appendix_b",
    "arc_jacobian",
    "arc_position",
    "arc_rotation",
    "arm_jacobian",
    "arm_position",
    "camera_jacobian",
    "camera_pose",
    "check_without_drag",
    "columns_of",
    "coriolis_matrix",
    "damping_vector",
    "elastic_vector",
    "euler_angles",
    "euler_rate_matrix",
    "facing",
    "forward_dynamics",
    "gravity_vector",
    "image_jacobian",
    "in_view",
    "integrated_coupling",
    "interaction_matrix",
    "jacobian",
    "kinematic_servoing",
    "kinetic_energy",
    "look",
    "masks",
    "mass_matrix",
    "position",
    "potential_energy",
    "printed_image_jacobian",
    "project",
    "rigid_motion",
    "rod_accelerations",
    "rod_curve",
    "rotation",
    "section_rotation",
    "skew",
    "slices",
    "strain_of",
    "tendon_lengths",
    "tip_of",
    "to_normalised",
    "to_pixels",
    "weight_vector",
]
