// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app_process.h"

namespace d2s1r::test
{
/// Runs lines of Python that use the programs of experiments/.
class ExperimentScripts : public AppTest
{
   protected:
	/// \param modules that the programs need, separated by commas
	explicit ExperimentScripts(std::string modules) : modules_(std::move(modules)) {}

	void SetUp() override
	{
		if (run_program({kPython, "-c", "import " + modules_}).status != 0)
			GTEST_SKIP() << "NOT ALL OF " << modules_
			             << " CAN BE IMPORTED: install Debian's python3-numpy, python3-scipy "
			             << "and python3-pil";
	}

	/// Returns what a script prints.
	std::string printed(const std::string& script) const
	{
		const std::string path =
		    "import sys; sys.path.insert(0, '" + std::string(D2S1R_SOURCE_DIR) + "/experiments')\n";
		const ProcessResult told = run_program({kPython, "-B", "-c", path + script});
		EXPECT_EQ(told.status, 0) << told.err;
		return told.out;
	}

	static constexpr const char* kPython = "/usr/bin/python3";  // the one that Debian's packages are for

   private:
	std::string modules_;
};
}  // namespace d2s1r::test
