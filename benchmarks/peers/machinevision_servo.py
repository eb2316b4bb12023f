"""machinevision-toolbox: image-based servoing of a free-flying camera on four points."""

from __future__ import annotations

from measuring import Case, Setup, serve

ITERATIONS = 100


def servo(setup: Setup) -> Case:
    with setup.timed("import"):
        import numpy as np
        from machinevisiontoolbox import IBVS, CentralCamera
        from spatialmath import SE3
    points = np.array([[-0.25, -0.25, 3], [-0.25, 0.25, 3], [0.25, 0.25, 3], [0.25, -0.25, 3.0]])
    goal = 200.0 * np.array([[-1, -1, 1, 1], [-1, 1, 1, -1]]) + 500.0
    start = SE3.Trans(1, 1, -3) * SE3.Rz(0.6)
    with setup.timed("build"):
        camera = CentralCamera(f=0.008, rho=1e-5, imagesize=1000, pp=(500, 500), pose=start)
        loop = IBVS(camera, P=points.T, p_d=goal, eterm=0.0, graphics=False)

    def run() -> None:
        camera.pose = start
        loop.init()
        loop.history = []
        for i in range(ITERATIONS):
            assert loop.step(float(i)) == 0

    what = "camera, interaction matrix, pseudo-inverse law, and the camera's motion; no dynamics"
    return Case(run, ITERATIONS, "servo iteration", what, integrator="none")


if __name__ == "__main__":
    serve(
        ["machinevision-toolbox-python", "spatialmath-python", "numpy"], {"servo loop": servo}, {}
    )
