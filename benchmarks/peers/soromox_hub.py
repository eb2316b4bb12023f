"""SoRoMoX: a floating base, a rigid segment for the hub, and sections that bend about two axes."""

from __future__ import annotations

from typing import Any

from measuring import Builder, Case, Setup, serve

STEP = 1e-4
HUB_LENGTH, HUB_RADIUS = 0.12, 0.15


def robot(vehicle: dict[str, Any], sections: int, points: int) -> Any:
    import jax.numpy as jnp
    import numpy as np
    from soromox.systems import PCS, PCSStructure
    from soromox.systems.components import LinkSpec

    material = {
        "young_modulus": vehicle["youngs_modulus"],
        "poisson_ratio": 0.3,
        "reference_strain": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    }
    volume = np.pi * HUB_RADIUS**2 * HUB_LENGTH
    hub = LinkSpec.circular(
        length=HUB_LENGTH, radius=HUB_RADIUS, density=vehicle["uav_mass"] / volume, **material
    )
    rod = LinkSpec.circular(
        length=vehicle["length"] / sections,
        radius=vehicle["radius"],
        density=vehicle["density"],
        **material,
    )
    bending = [False] * 6 + [False, True, True, False, False, False] * sections
    return PCS.from_links(
        [hub, *[rod] * sections],
        structure=PCSStructure(num_gauss_points=points, strain_selector=jnp.asarray(bending)),
        gravity=jnp.asarray([0.0, 0.0, -9.81]),
        floating_base=True,
        backend="jax",
    )


def strained(vehicle: dict[str, Any], points: int) -> Any:
    """The hub with an arm whose bend is linear along it, in both directions."""
    import jax.numpy as jnp
    import numpy as np
    from soromox.systems.components import JointSpec, LinkSpec
    from soromox.systems.gvs import GVS, GVSSegment, StrainBasisSpec

    volume = np.pi * HUB_RADIUS**2 * HUB_LENGTH
    hub = HUB_LENGTH, HUB_RADIUS, vehicle["uav_mass"] / volume, []
    rod = vehicle["length"], vehicle["radius"], vehicle["density"], [1, 2]
    segments = []
    for length, radius, density, bending in (hub, rod):
        varies = [int(component in bending) for component in range(6)]
        link = LinkSpec.circular(
            length=length,
            radius=radius,
            density=density,
            young_modulus=vehicle["youngs_modulus"],
            poisson_ratio=0.3,
            reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        )
        basis = StrainBasisSpec("legendre", varies, varies)
        segments.append(
            GVSSegment(link=link, joint=JointSpec.fixed(), num_gauss_points=points, basis=basis)
        )
    gravity = jnp.asarray([0.0, 0.0, -9.81])
    return GVS.from_segments(segments, gravity=gravity, floating_base=True, backend="jax")


def flight(
    runs: int, steps: int, points: int = 5, sections: int = 1, linear: bool = False
) -> Builder:
    """runs: 1 for a single flight, more for a batch through vmap. points: of Gauss, 5 by default,
    in each of the equal sections of the arm. linear: one section, with a bend linear along it.

    Five do not resolve an arm bent to a full circle (4e-5 of the accelerations); twelve do, to the
    1e-7 that the rounding of its nodes leaves.
    """

    def build(setup: Setup) -> Case:
        with setup.timed("import"):
            import jax

            jax.config.update("jax_enable_x64", True)
            import jax.numpy as jnp
            import numpy as np
            import soromox.systems  # noqa: F401
        with setup.timed("build"):
            arm = (
                strained(setup.vehicle, points)
                if linear
                else robot(setup.vehicle, sections, points)
            )
        bends = 4 if linear else 2 * sections

        def rate(y: Any) -> Any:
            return arm.forward_dynamics(0.0, y, (None, jnp.zeros(6 + bends)))

        def advance(y: Any, _: None) -> tuple[Any, None]:
            k1 = rate(y)
            k2 = rate(y + 0.5 * STEP * k1)
            k3 = rate(y + 0.5 * STEP * k2)
            k4 = rate(y + STEP * k3)
            return y + STEP / 6 * (k1 + 2 * (k2 + k3) + k4), None

        def fly(y: Any) -> Any:
            return jax.lax.scan(advance, y, None, length=steps)[0]

        # Backbone down (its local x along world -z), slightly bent, turning slowly.
        half = np.sqrt(0.5)
        q = [0.0, half, 0.0, half, 0.0, 0.0, 5.0, *[0.05] * bends]
        v = [0.1] * 3 + [0.0] * (3 + bends)
        start = jnp.asarray(q + v)
        if runs > 1:
            start, fly = jnp.tile(start, (runs, 1)), jax.vmap(fly)
        with setup.timed("compile"):
            compiled = jax.jit(fly).lower(start).compile()

        def run() -> None:
            assert np.isfinite(np.asarray(compiled(start))).all()

        several = f", {runs} runs by vmap" if runs > 1 else ""
        arms = "one section" if sections == 1 else f"{sections} sections"
        arms = "linear strain" if linear else arms
        what = f"floating hub and {arms} of {points} Gauss points, {6 + bends} DoF{several}"
        return Case(run, runs * steps, "RK4 step", what, step=STEP, runs=runs)

    return build


if __name__ == "__main__":
    serve(
        ["soromox", "jax", "jaxlib"],
        {
            "floating hub": flight(1, 500),
            "floating hub, 12 points": flight(1, 300, 12),
            "floating hub, two sections": flight(1, 200, sections=2),
        },
        {
            "floating hub, batch": flight(64, 20),
            "floating hub, two sections, batch": flight(64, 10, sections=2),
            "floating hub, linear strain, batch": flight(64, 20, points=6, linear=True),
        },
    )
