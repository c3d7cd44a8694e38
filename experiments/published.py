# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What the paper reports: Wang, Zhang, Zhao and Zhang, IEEE Sensors Journal 21(10), 2021, Tables III, IV and V."""

# (site, set) -> the paper's name of its set of the same laboratory, simulated on or off the mapping path
NAMES = {
    ("intel", "sim360_on"): "D_I0",
    ("intel", "sim360_off"): "D_I1",
}
OTHERS = ("D_M0", "D_M1", "D_G0", "D_G1")  # buildings that we do not have
AREAS = {"D_M0": 3853, "D_M1": 3853, "D_G0": 3644, "D_G1": 3644}  # [m^2] Table I

# Table III [ms]: retrieval, yaw (t3 - t1 is about ten times that: of one candidate), all; i7-8750H, one thread
TIMES = {"D_M0": (0.26, 2.14, 23.21), "D_I0": (0.21, 2.15, 22.82), "D_G0": (1.69, 2.18, 26.30)}

# Table IV [%], 0.2 m and 5 deg: Sivic and Zisserman, Tipaldi et al., D2S1R
SUCCESS = {"D_M0": (84, 81, 94), "D_I0": (99, 98, 97), "D_G0": (92, 85, 91),
           "D_M1": (63, 62, 94), "D_I1": (82, 87, 93), "D_G1": (56, 37, 97)}

# Table V: position error [m] and yaw error [deg], mean, then their standard deviations; of successes, it seems
PRECISION = {"D_M0": (0.08, 0.61, 0.04, 0.45), "D_I0": (0.08, 0.89, 0.03, 0.87), "D_G0": (0.09, 0.63, 0.04, 0.47),
             "D_M1": (0.07, 0.71, 0.04, 0.44), "D_I1": (0.09, 0.81, 0.04, 0.70), "D_G1": (0.09, 0.71, 0.04, 0.65),
             "All": (0.08, 0.72, 0.04, 0.60)}
