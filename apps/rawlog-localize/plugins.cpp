// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "plugins.h"

#include "errors.h"

#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/system/os.h>
#include <mrpt/system/string_utils.h>

#include <algorithm>
#include <filesystem>

namespace d2s1r::app
{
namespace
{
constexpr const char* kFusionClass = "d2s1r::CParticleFilterFusion";
constexpr const char* kFusionModule = "libd2s1r-pf-init.so";

void load(const std::string& modules, const std::string& flag)
{
	std::string errors;
	if (mrpt::system::loadPluginModules(modules, errors)) return;
	std::replace(errors.begin(), errors.end(), '\n', ' ');  // between the name of a module and why it does not load
	throw UserError(kWrongUse, flag, mrpt::system::trim(errors) + "; check the paths and what the modules need");
}

void load_fusion_module()
{
	std::error_code error;
	const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
	for (const auto& folder : {program, program / D2S1R_MODULE_FOLDER})
		if (const auto module = folder / kFusionModule; std::filesystem::exists(module, error))
			return load(module.string(), "--fuse");
}
}  // namespace

void load_plugins(const Flags& flags)
{
	mrpt::maps::registerAllClasses_mrpt_maps();
	if (!flags.plugins.empty()) load(flags.plugins, "--plugins");
	if (flags.fuse && !mrpt::rtti::findRegisteredClass(kFusionClass)) load_fusion_module();
}

CFusionBackend::Ptr find_fusion_backend()
{
	auto backend = std::dynamic_pointer_cast<CFusionBackend>(mrpt::rtti::classFactory(kFusionClass));
	if (!backend)
		throw UserError(
		    kWrongUse, "--fuse",
		    std::string("the pf-init plug-in with the particle filter is missing; name ") + kFusionModule +
		        " with --plugins, or run without --fuse");
	return backend;
}
}  // namespace d2s1r::app
