"""
One arm that swings sets the other one swinging
===============================================

A vehicle with two arms, without gravity: the left one is let go from a bend, the right one starts
at rest. It is the UAV that carries the motion over. In the decoupled model arms do not see each
other, and the right one stays at rest.
"""

import matplotlib.pyplot as plt

import continuair as ca


def main() -> None:
    vehicle = ca.load_vehicle("dual_arm")
    start = [0, 0, 0, 0, 0, 0, 1.0, 0, 0, 0]  # both bends at the end, the left one 1 1/m along x
    swing = ca.Scenario("let go", start, gravity=0.0, duration=1.5)
    figure, panels = plt.subplots(2, 1, sharex=True, figsize=(6, 4), layout="constrained")
    for model, colour in (("coupled", "black"), ("decoupled", "#D55E00")):
        bend = ca.simulate(vehicle, swing, model=model, variables=["bend"]).bend
        for index, axes in enumerate(panels):
            axes.plot(bend.time, bend[:, index, 0], color=colour, label=model)
        print(f"{model}: the right arm bends by up to {float(abs(bend[:, 1]).max()):.3f} 1/m")
    panels[0].set(ylabel="left arm [1/m]", title="bend along x")
    panels[1].set(ylabel="right arm [1/m]", xlabel="time [s]")
    panels[0].legend(loc="upper right")
    plt.show()


if __name__ == "__main__":
    main()
