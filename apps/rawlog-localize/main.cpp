// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/console.h"
#include "cli/errors.h"
#include "run.h"

int main(int argc, char** argv)
{
	using namespace d2s1r::app;
	Console console;
	catch_interrupts();
	try
	{
		const auto flags = parse_flags(argc, argv, console.out);
		const ExitStatus status = flags ? run(*flags, console) : kDone;
		if (status == kDone) console.check_written();
		return status;
	}
	catch (const UserError& e)
	{
		console.err << "rawlog-localize: " << one_line(e) << std::endl;
		return e.status;
	}
	catch (const std::bad_alloc&)
	{
		console.err << "rawlog-localize: not enough memory; use a coarser map or fewer threads" << std::endl;
		return kBadInput;
	}
	catch (const std::exception& e)
	{
		console.err << "rawlog-localize: " << one_line(e) << "; this is a defect, please report it" << std::endl;
		return kBadInput;
	}
}
