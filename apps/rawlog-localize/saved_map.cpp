// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "saved_map.h"

#include "gzip_file.h"

#include <d2s1r/CSignatureMap2D.h>

namespace d2s1r::app
{
void save_map(const Localizer& localizer, const std::string& path)
{
	GzipFile file(path);
	file.write(CSignatureMap2D(localizer.map(), localizer.parameters()));
	file.commit();
}
}  // namespace d2s1r::app
