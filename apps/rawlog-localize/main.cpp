// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/output_file.h>
#include <d2s1r/simd_targets.h>
#include <logs/errors.h>
#include <shell/errors.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "cli/console.h"
#include "run.h"

namespace
{
using namespace d2s1r;
using namespace d2s1r::app;

constexpr char kOutOfMemory[] = "rawlog-localize: not enough memory; use a coarser map or fewer threads\n";
std::terminate_handler usual_handler = nullptr;
std::optional<int> final_status;  // once all is done and told

/// Libraries let memory run out where no exception may pass. Files that were being written are left under their
/// temporary names, which the next run removes.
[[noreturn]] void end_without_memory()
{
	try
	{
		if (const auto exception = std::current_exception()) std::rethrow_exception(exception);
	}
	catch (const std::bad_alloc&)
	{
		if (final_status) std::_Exit(*final_status);
		if (write(STDERR_FILENO, kOutOfMemory, sizeof kOutOfMemory - 1) > 0) std::_Exit(kBadInput);
	}
	catch (...)
	{
	}
	usual_handler();
	std::abort();
}

/// Lets D2S1R_SIMD choose the SIMD target. \throws UserError (kWrongUse) if there is no such target
void choose_simd_target()
{
	const char* name = std::getenv("D2S1R_SIMD");
	if (!name || !*name) return;
	try
	{
		use_simd_target(name);
	}
	catch (const std::invalid_argument& e)
	{
		throw UserError(kWrongUse, "D2S1R_SIMD", e.what());
	}
}

/// Runs the program and tells what went wrong, unless there is no memory even for that.
int run_and_tell(int argc, char** argv, Console& console)
{
	try
	{
		choose_simd_target();
		std::ostringstream text;
		const auto command = parse_command_line(argc, argv, text);
		if (!command) console.print(text.str());
		const ExitStatus status = command ? run(*command, console) : kDone;
		if (status == kDone) console.check_written();
		return status;
	}
	catch (const UserError& e)
	{
		console.say(one_line(e));
		return e.status;
	}
	catch (const OutputError& e)
	{
		console.say(one_line(e));
		return kBadOutput;
	}
	catch (const logs::LogError& e)
	{
		console.say(one_line(e));
		return kBadInput;
	}
	catch (const std::exception& e)
	{
		if (is_out_of_memory(e)) throw std::bad_alloc();
		console.say(one_line(e) + "; this is a defect, please report it");
		return kBadInput;
	}
}
}  // namespace

int main(int argc, char** argv)
{
	Console console;
	catch_signals();
	usual_handler = std::set_terminate(end_without_memory);
	int status = kBadInput;
	try
	{
		status = run_and_tell(argc, argv, console);
	}
	catch (const std::bad_alloc&)
	{
		console.err << kOutOfMemory << std::flush;
	}
	final_status = status;
	if (status != kInterrupted) return status;
	console.out.flush();
	std::_Exit(status);  // work may still be going on, see run_interruptibly()
}
