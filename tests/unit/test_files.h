// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace d2s1r::test
{
/// A folder of its own for a test, gone with it.
class TempFolder
{
   public:
	TempFolder()
	{
		std::string pattern = (std::filesystem::temp_directory_path() / "d2s1r-test-XXXXXX").string();
		if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make " + pattern);
		path_ = pattern;
	}
	~TempFolder() { std::filesystem::remove_all(path_); }
	TempFolder(const TempFolder&) = delete;
	TempFolder& operator=(const TempFolder&) = delete;

	std::string path(const std::string& name) const { return (path_ / name).string(); }

	/// Writes a file and returns its path.
	std::string write(const std::string& name, const std::string& bytes) const
	{
		std::ofstream(path(name), std::ios::binary) << bytes;
		return path(name);
	}

   private:
	std::filesystem::path path_;
};

/// While it lives, permissions of files count for root, too.
class OrdinaryUser
{
   public:
	OrdinaryUser()
	{
		constexpr uid_t kNobody = 65534;
		if (was_ == 0 && seteuid(kNobody) != 0) throw std::runtime_error("cannot become another user");
	}
	~OrdinaryUser()
	{
		if (was_ == 0 && seteuid(was_) != 0) std::abort();
	}
	OrdinaryUser(const OrdinaryUser&) = delete;
	OrdinaryUser& operator=(const OrdinaryUser&) = delete;

   private:
	uid_t was_ = geteuid();
};

inline std::string read_bytes(const std::string& file)
{
	std::ifstream stream(file, std::ios::binary);
	return {std::istreambuf_iterator<char>(stream), {}};
}

/// What() of the `Error` that `action` throws; empty if it throws none.
template <class Error, class Action>
std::string message_of(Action&& action)
{
	try
	{
		action();
	}
	catch (const Error& error)
	{
		return error.what();
	}
	return {};
}
}  // namespace d2s1r::test
