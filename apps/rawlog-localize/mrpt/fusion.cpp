// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause

#include "mrpt/fusion.h"

#include <d2s1r/CFusionBackend.h>
#include <logs/mrpt_objects.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/system/os.h>
#include <mrpt/system/string_utils.h>
#include <shell/errors.h>

#include <algorithm>
#include <filesystem>

namespace d2s1r::app
{
const bool kHasMrpt = true;

namespace
{
constexpr const char* kFusionClass = "d2s1r::CParticleFilterFusion";
constexpr const char* kFusionModule = "libd2s1r-pf-init.so";

void load(const std::string& modules, const std::string& option)
{
	std::string errors;
	if (mrpt::system::loadPluginModules(modules, errors)) return;
	std::replace(
	    errors.begin(), errors.end(), '\n', ' ');  // MRPT breaks the line between the name of a module and the reason
	throw UserError(kWrongUse, option, mrpt::system::trim(errors) + "; check the paths and what the modules need");
}

void load_fusion_module()
{
	std::error_code error;
	const auto program = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
	for (const auto& folder : {program, program / D2S1R_MODULE_FOLDER})
		if (const auto module = folder / kFusionModule; std::filesystem::exists(module, error))
			return load(module.string(), "--fuse");
}

class FusionByBackend : public Fusion
{
   public:
	explicit FusionByBackend(CFusionBackend::Ptr backend) : backend_(std::move(backend)) {}

	void start(const std::vector<IndexedMap>& maps, const SearchRequest& search) override
	{
		std::vector<FusionMap> of_fusion;
		for (const IndexedMap& map : maps)
			of_fusion.push_back(
			    {std::make_shared<const CSignatureMap2D>(map.localizer), map.entry.region, map.entry.name});
		backend_->start(of_fusion, {search.motion, maps.front().localizer->parameters().filter, search.seed});
	}

	std::optional<FusedPose> step(
	    const logs::RecordedScan& scan, const Localization& alone,
	    const std::optional<mrpt::poses::CPose2D>& motion) override
	{
		return backend_->step({logs::observation_of(scan), alone, motion});
	}

   private:
	CFusionBackend::Ptr backend_;
};
}  // namespace

void load_plugins(const CommandLine& command)
{
	const SearchRequest& request = command.search;
	mrpt::maps::registerAllClasses_mrpt_maps();
	if (!request.plugins.empty()) load(request.plugins, "--plugins");
	if (request.fuse && !mrpt::rtti::findRegisteredClass(kFusionClass)) load_fusion_module();
}

std::unique_ptr<Fusion> find_fusion()
{
	auto backend = std::dynamic_pointer_cast<CFusionBackend>(mrpt::rtti::classFactory(kFusionClass));
	if (!backend)
		throw UserError(
		    kWrongUse, "--fuse",
		    std::string("the pf-init plug-in with the particle filter is missing; name ") + kFusionModule +
		        " with --plugins, or run without --fuse");
	return std::make_unique<FusionByBackend>(std::move(backend));
}
}  // namespace d2s1r::app
