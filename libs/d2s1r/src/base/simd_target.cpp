// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/simd.h"

#include <d2s1r/simd_targets.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <stdexcept>

namespace d2s1r
{
namespace
{
constexpr std::int64_t kCompiled = HWY_TARGETS & ~static_cast<std::int64_t>(HWY_DISABLED_TARGETS);

std::string name_of(std::int64_t target)
{
	if (target == HWY_EMU128 || target == HWY_SCALAR) return "portable";
	std::string name = hwy::TargetName(target);
	std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
	return name;
}

/// Returns the targets that this machine runs and the library was compiled for, the best first: Highway gives better
/// ones the lower bits.
std::vector<std::int64_t> usable_targets()
{
	std::vector<std::int64_t> targets;
	for (std::int64_t left = hwy::SupportedTargets() & kCompiled; left != 0; left &= left - 1)
		targets.push_back(left & -left);
	return targets;
}
}  // namespace

std::vector<std::string> simd_targets()
{
	std::vector<std::string> names;
	for (const std::int64_t target : usable_targets()) names.push_back(name_of(target));
	return names;
}

void use_simd_target(const std::string& name)
{
	std::string known;
	for (const std::int64_t target : usable_targets())
	{
		known += (known.empty() ? "" : ", ") + name_of(target);
		if (name_of(target) != name) continue;
		hwy::SetSupportedTargetsForTest(target);
		hwy::GetChosenTarget().Update(target);
		return;
	}
	throw std::invalid_argument("'" + name + "' is not a SIMD target of this machine; choose one of " + known);
}
}  // namespace d2s1r
