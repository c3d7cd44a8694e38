// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// replay_TARGET FILE_OR_FOLDER...: runs a fuzz target on stored cases, without libFuzzer, so that any compiler does.
#include <filesystem>
#include <iostream>
#include <iterator>
#include <vector>

#include "fuzz_input.h"

namespace fs = std::filesystem;

int main(int argc, char** argv)
{
	std::size_t cases = 0;
	const auto run = [&](const fs::path& file)
	{
		std::ifstream stream(file, std::ios::binary);
		const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
		LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
		cases++;
	};
	for (int i = 1; i < argc; i++)
		if (fs::is_directory(argv[i]))
			for (const auto& entry : fs::directory_iterator(argv[i])) run(entry.path());
		else
			run(argv[i]);
	std::cout << cases << " cases\n";
	return cases > 0 ? 0 : 1;
}
