// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <streambuf>

namespace d2s1r::app
{
/// Owns what the user sees: while it lives, std::cout, std::cerr and std::clog, which MRPT writes to as it pleases,
/// lead nowhere.
class Console
{
   public:
	Console();
	~Console();
	Console(const Console&) = delete;
	Console& operator=(const Console&) = delete;

	/// \throws UserError (kBadOutput) if standard output did not take all that was printed
	void check_written();

	std::ostream out;  //!< the process's standard output
	std::ostream err;  //!< the process's standard error

   private:
	std::streambuf* old_log_;
};

/// While it lives, file descriptors 1 and 2 lead nowhere: image libraries written in C do not use the streams.
class SilentDescriptors
{
   public:
	SilentDescriptors();
	~SilentDescriptors();
	SilentDescriptors(const SilentDescriptors&) = delete;
	SilentDescriptors& operator=(const SilentDescriptors&) = delete;

   private:
	int old_out_;
	int old_err_;
};
}  // namespace d2s1r::app
