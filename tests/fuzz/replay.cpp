// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// replay_TARGET [--seconds N] FILE_OR_FOLDER...: runs a fuzz target without libFuzzer, so that any compiler does: on
// the stored cases and then, for some time, on cases that differ from them at random places. Their order is the same in
// every run. The case at work stands in a file of this folder, which stays if the case ends the program.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <random>
#include <vector>

#include "fuzz_input.h"

namespace fs = std::filesystem;

namespace
{
using Case = std::vector<std::uint8_t>;

Case read_case(const fs::path& file)
{
	std::ifstream stream(file, std::ios::binary);
	return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the cases of files and folders, in the order of their names.
std::vector<Case> read_cases(const std::vector<std::string>& names)
{
	std::vector<fs::path> files;
	for (const auto& name : names)
		if (fs::is_directory(name))
			for (const auto& entry : fs::directory_iterator(name)) files.push_back(entry.path());
		else
			files.emplace_back(name);
	std::sort(files.begin(), files.end());
	std::vector<Case> cases;
	for (const auto& file : files) cases.push_back(read_case(file));
	return cases;
}

/// Makes cases out of others.
class Mutator
{
   public:
	explicit Mutator(const std::vector<Case>& cases) : cases_(cases) {}

	Case next()
	{
		constexpr std::size_t kLongest = 16384, kChanges = 8;  // [byte], [-]
		Case made = any_case();
		for (std::size_t i = 1 + below(kChanges); i > 0; i--) change(made);
		made.resize(std::min(made.size(), kLongest));
		return made;
	}

   private:
	std::size_t below(std::size_t past) { return past == 0 ? 0 : random_() % past; }
	const Case& any_case() { return cases_[below(cases_.size())]; }

	/// Some bytes of a case.
	std::pair<Case::const_iterator, Case::const_iterator> part_of(const Case& from)
	{
		constexpr std::size_t kLongest = 64;  // [byte]
		const std::size_t begin = below(from.size() + 1);
		const std::size_t length = std::min(from.size() - begin, below(kLongest));
		const auto first = from.begin() + static_cast<std::ptrdiff_t>(begin);
		return {first, first + static_cast<std::ptrdiff_t>(length)};
	}

	void change(Case& made)
	{
		constexpr std::uint8_t kOdd[] = {0, 1, 9, 10, 13, 27, ' ', '"', '-', '.', '0', '9', 'e', 0x7f, 0x80, 0xff};
		const Case before = made;
		const std::size_t at = below(made.size());
		const auto place = made.begin() + static_cast<std::ptrdiff_t>(at);
		const auto part = part_of(random_() % 2 == 0 ? before : any_case());
		switch (made.empty() ? 4 : random_() % 6)
		{
			case 0:  // another bit
				made[at] = static_cast<std::uint8_t>(made[at] ^ (1U << below(8)));
				break;
			case 1:  // another byte
				made[at] = static_cast<std::uint8_t>(random_());
				break;
			case 2:  // a byte where mistakes are frequent
				made[at] = kOdd[below(std::size(kOdd))];
				break;
			case 3:  // less
				made.erase(
				    place, place + static_cast<std::ptrdiff_t>(below(std::min<std::size_t>(64, made.size() - at))));
				break;
			case 4:  // more
				made.insert(place, part.first, part.second);
				break;
			default:  // something else in its place
				std::copy_n(part.first, std::min(part.second - part.first, made.end() - place), place);
		}
	}

	const std::vector<Case>& cases_;
	std::mt19937_64 random_{1};
};
}  // namespace

int main(int argc, char** argv)
{
	std::vector<std::string> names(argv + 1, argv + argc);
	std::chrono::seconds time(0);
	if (names.size() > 1 && names[0] == "--seconds")
	{
		time = std::chrono::seconds(std::stol(names[1]));
		names.erase(names.begin(), names.begin() + 2);
	}
	const std::vector<Case> cases = read_cases(names);
	for (const Case& stored : cases) LLVMFuzzerTestOneInput(stored.data(), stored.size());
	std::cout << cases.size() << " cases\n";
	if (cases.empty()) return 1;

	const fs::path at_work = fs::absolute(fs::path(argv[0]).filename().string() + "-case");
	std::size_t made = 0;
	Mutator mutator(cases);
	const auto end = std::chrono::steady_clock::now() + time;
	for (; std::chrono::steady_clock::now() < end; made++)
	{
		const Case next = mutator.next();
		std::ofstream(at_work, std::ios::binary)
		    .write(reinterpret_cast<const char*>(next.data()), static_cast<std::streamsize>(next.size()));
		if (made == 0) std::cout << "the case at work is in " << at_work.string() << std::endl;
		LLVMFuzzerTestOneInput(next.data(), next.size());
	}
	fs::remove(at_work);
	if (time.count() > 0) std::cout << made << " made of them\n";
	return 0;
}
