"""A robot far away goes where the hand is, and what its sensor feels is felt by the hand. python robot_loop.py http://haptic-pc:4860 haptic-pc:4857 force.key [TOKEN]"""

import sys
import taut

_, observers, server, key, *token = sys.argv
with taut.watch(observers, *token) as states, taut.push_wrench(server, key) as hand:
    for state in states:
        x = state["tools"][0]["device"][0]  # m; here your robot goes to the pose
        measured = [50 * (0.04 - x), 0, 0, 0, 0, 0]  # N, N m; yours is what its sensor says. This one is a spring of 50 N/m, drawn to x = 40 mm
        hand.send(measured, age=0.001)  # s since it was measured
