"""
The paper's Lyapunov function rises where a sound one falls
===========================================================

Along one flight of the servoing law towards a target at rest: the function of the paper's proof
grows, as the proof drops a term that is not small. With the arm's spring and the image's own
potential in it, one that never grows is found.
"""

import matplotlib.pyplot as plt

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03})
    law = ca.servoing(Kp=20.0, Kd=0.5, Cp=1.5, Cd=0.1, Cs=0.05, sigma=0.02)
    still = ca.Scenario(
        "still",
        [0.1, 0, 3.1, 0, 0, 0, 0.1, 0],
        controller=law,
        target=ca.Target(ca.paths.hold()),
        control_period=None,
    )
    found = ca.lyapunov(vehicle, still, ca.simulate(vehicle, still, sample=1e-3)).over_time
    figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
    for name, colour in (("paper", "#D55E00"), ("sound", "black")):
        value = found[f"lyapunov_{name}"]
        axes.plot(found.time, value / float(value[0]), color=colour, label=name)
    axes.set(xlabel="time [s]", ylabel="V over its start [-]", yscale="log")
    axes.legend()
    print(f"the sound one grows by at most {float(found.lyapunov_sound_rate.max()):.1e} W")
    plt.show()


if __name__ == "__main__":
    main()
