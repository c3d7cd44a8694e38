// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace d2s1r::test
{
/// Gives each test a folder of its own, which is removed afterwards.
class FolderTest : public testing::Test
{
   protected:
	FolderTest()
	{
		std::string name = (std::filesystem::temp_directory_path() / "d2s1r-unit-XXXXXX").string();
		if (!mkdtemp(name.data())) throw std::runtime_error("cannot make a folder for the test");
		folder_ = name;
	}
	~FolderTest() override
	{
		std::error_code ignored;
		std::filesystem::remove_all(folder_, ignored);
	}

	std::string path(const std::string& name) const { return (folder_ / name).string(); }

	void write(const std::string& name, const std::string& content) const
	{
		std::ofstream(path(name), std::ios::binary) << content;
	}
	std::string read(const std::string& name) const
	{
		std::ifstream in(path(name), std::ios::binary);
		return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
	}

	/// Number of files and folders in the folder.
	std::ptrdiff_t count() const
	{
		return std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator());
	}

   private:
	std::filesystem::path folder_;
};
}  // namespace d2s1r::test
