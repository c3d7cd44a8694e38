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

# Programs of others that cannot be included because of their licences or what they depend on, built and run by us as
# they are shipped, one thread each: (name, settings, scans, success [%], time a scan [ms]). 60 real 180 deg scans of a
# site, test.rawlog on map_test, within 0.3 m and 5 deg, unless the row says otherwise.
PEERS = (
    ("CBGL with PL-ICP", "as shipped", "intel / fr079 / mit_csail", "42 / 55 / 23", "589 / 1,042 / 1,964"),
    ("CBGL with PL-ICP", "as shipped", "94 full circles, clean", "98", "943 (intel)"),
    ("CBGL with PL-ICP", "as shipped", "94 full circles, 20 % blocked", "84", "-"),
    ("iris_lama Loc2D", "as shipped", "intel / fr079 / mit_csail", "50 / 45 / 53", "285 / 372 / 442"),
    ("iris_lama Loc2D", "as shipped", "94 full circles, clean", "83", "386 (intel)"),
    ("iris_lama Loc2D", "as shipped", "94 full circles, 20 % blocked", "51", "-"),
    ("Cartographer, branch and bound", "as shipped", "intel / fr079 / mit_csail", "70 / 65 / 57", "1,025 / 1,640 / 3,061"),
    ("Cartographer, branch and bound", "as shipped", "31 full circles, clean", "90", "4,479 (intel)"),
    ("Cartographer, branch and bound", "as shipped", "23 full circles, 20 % blocked", "83", "-"),
    ("GFP (the authors' FLIRT phrases)", "as shipped", "300 full circles, clean", "61", "50 (intel)"),
    ("GFP (the authors' FLIRT phrases)", "as shipped", "300 full circles, 20 % blocked", "44", "-"),
    ("relocalization_toolbox, November 2025", "as shipped", "380 scans of seven sites", "74", "100 to 650 times ours"),
)
