"""RotorPy: batches of rigid quadrotors with aerodynamic drag, RK4 in PyTorch."""

from __future__ import annotations

from measuring import Builder, Case, Setup, serve

STEP = 1e-3


def fleet(runs: int, steps: int) -> Builder:
    def build(setup: Setup) -> Case:
        with setup.timed("import"):
            import torch
            from rotorpy.vehicles.crazyflie_params import quad_params
            from rotorpy.vehicles.multirotor import BatchedMultirotor, BatchedMultirotorParams
        torch.set_num_threads(setup.threads)
        device = torch.device("cpu")

        def tensor(row: list[float]) -> torch.Tensor:
            return torch.tensor([row] * runs, dtype=torch.float64)

        with setup.timed("build"):
            state = {
                "x": tensor([0.0, 0.0, 5.0]),
                "v": tensor([0.0] * 3),
                "q": tensor([0.0, 0.0, 0.0, 1.0]),
                "w": tensor([0.1] * 3),
                "wind": tensor([0.0] * 3),
                "rotor_speeds": tensor([1788.53] * 4),
            }
            vehicles = BatchedMultirotor(
                BatchedMultirotorParams([quad_params] * runs, runs, device),
                runs,
                state,
                device,
                integrator="rk4",
            )
        control = {"cmd_motor_speeds": tensor([1788.53] * 4)}

        def run() -> None:
            now = state
            for _ in range(steps):
                now = vehicles.step(now, control, STEP)
            assert torch.isfinite(now["x"]).all()

        what = f"rigid quadrotor without arm, with drag, {runs} vehicles"
        return Case(run, runs * steps, "RK4 step", what, step=STEP, runs=runs)

    return build


if __name__ == "__main__":
    serve(["rotorpy", "torch", "torchdiffeq", "roma"], {}, {"rigid vehicle, batch": fleet(4096, 4)})
