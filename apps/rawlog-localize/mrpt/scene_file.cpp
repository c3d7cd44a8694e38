// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "mrpt/scene_file.h"

#include <d2s1r/gzip_file.h>
#include <d2s1r/mrpt_version.h>
#include <logs/mrpt_objects.h>
#include <mrpt/img/CImage.h>

#include "picture/canvas.h"
#include "picture/map_view.h"

#include D2S1R_DRAWING(CEllipsoid2D.h)
#include D2S1R_DRAWING_SCENE
#include D2S1R_DRAWING(CPlanarLaserScan.h)
#include D2S1R_DRAWING(CSetOfLines.h)
#include D2S1R_DRAWING(CSetOfObjects.h)
#include D2S1R_DRAWING(CText3D.h)
#include D2S1R_DRAWING(CTexturedPlane.h)
#include D2S1R_DRAWING(stock_objects.h)

#include <algorithm>

namespace d2s1r::app
{
namespace
{
namespace gl = drawing;
constexpr int kTextureSide = 2048;      //!< [pixel] enough to look at, in a quarter of the time of 4096
constexpr float kAboveGrid = 0.02f;     //!< [m]
constexpr float kEllipseSigmas = 3.0f;  //!< [-] of the ellipses

mrpt::img::TColor drawn(const Color& color)
{
	return {color.red, color.green, color.blue};
}

DrawnObject::Ptr grid_object(const SceneContent& content)
{
	const Grid& grid = content.grid;
	const MapView view = fit_view(grid, kTextureSide, 1);
	const auto greys = map_greys(grid, view);
	const auto width = static_cast<std::size_t>(view.width);
	mrpt::img::CImage texture(
	    static_cast<unsigned>(view.width), static_cast<unsigned>(view.height), mrpt::img::CH_GRAY);
	for (int y = 0; y < view.height; y++)  // the lowest row of the map comes first
		std::copy_n(
		    greys.begin() + static_cast<std::ptrdiff_t>(width) * y, width,
		    texture.ptrLine<std::uint8_t>(static_cast<unsigned>(view.height - 1 - y)));
	auto plane = gl::CTexturedPlane::Create();
	const auto left = static_cast<float>(view.left), top = static_cast<float>(view.top);
	plane->setPlaneCorners(
	    left, left + static_cast<float>(grid.width * grid.cell_size),
	    top - static_cast<float>(grid.height * grid.cell_size), top);
	plane->assignImage(texture.colorImage());
	return plane;
}

DrawnObject::Ptr trajectory_object(const std::vector<KeptFrame>& frames)
{
	auto lines = gl::CSetOfLines::Create();
	lines->setColor_u8(drawn(kPathColor));
	lines->setLineWidth(3);
	for (const auto& piece : path_pieces(frames))
		for (std::size_t i = 1; i < piece.size(); i++)
		{
			const auto &from = piece[i - 1]->pose, &to = piece[i]->pose;
			lines->appendLine(from.x, from.y, kAboveGrid, to.x, to.y, kAboveGrid);
		}
	return lines;
}

DrawnObject::Ptr fused_object(const std::vector<KeptFrame>& frames)
{
	auto lines = gl::CSetOfLines::Create();
	lines->setColor_u8(drawn(kFusedColor));
	lines->setLineWidth(2);
	for (std::size_t i = 1; i < frames.size(); i++)
	{
		const auto &from = frames[i - 1].fused, &to = frames[i].fused;
		if (!is_fused_onwards(frames[i - 1], frames[i])) continue;
		lines->appendLine(from.x, from.y, 2 * kAboveGrid, to.x, to.y, 2 * kAboveGrid);
	}
	return lines;
}

DrawnObject::Ptr names_object(const std::vector<MapName>& names)
{
	auto texts = gl::CSetOfObjects::Create();
	for (const MapName& map : names)
	{
		const double size = 0.5 * map.height;  // [m]
		auto text = gl::CText3D::Create(map.name, "sans", size);
		text->setLocation(map.start.x, map.start.y - 0.5 * size, static_cast<double>(kAboveGrid));
		text->setColor_u8(drawn(kInk));
		texts->insert(text);
	}
	return texts;
}

gl::CEllipsoid2D::Ptr ellipse_object(const Hypothesis& hypothesis, const Color& color)
{
	auto ellipse = gl::CEllipsoid2D::Create();
	ellipse->setCovMatrix(mrpt::math::CMatrixDouble22(hypothesis.covariance.blockCopy<2, 2>(0, 0)));
	ellipse->setQuantiles(kEllipseSigmas);
	ellipse->setLocation(hypothesis.pose.x(), hypothesis.pose.y(), kAboveGrid);
	ellipse->setColor_u8(drawn(color));
	return ellipse;
}

/// Ellipses of the hypotheses, in a long run those of every n-th frame.
DrawnObject::Ptr hypotheses_object(const DrawnFrames& frames)
{
	constexpr std::size_t kMostFrames = 5000;
	const std::size_t step = 1 + frames.kept().size() / (kMostFrames + 1);
	auto ellipses = gl::CSetOfObjects::Create();
	std::size_t count = 0;
	frames.visit(
	    [&](const Frame& frame)
	    {
		    if (count++ % step != 0) return;
		    for (const auto& hypothesis : frame.result.hypotheses)
			    if (hypothesis.probability >= kLeastDrawnProbability)
				    ellipses->insert(ellipse_object(hypothesis, frame.localized() ? kPathColor : kHypothesisColor));
	    });
	return ellipses;
}

DrawnObject::Ptr scan_object(const SceneContent& content)
{
	auto scan = gl::CPlanarLaserScan::Create();
	scan->setScan(logs::observation_of(*content.last_scan));
	scan->enableSurface(true);
	for (const auto& frame : content.frames.kept())
		if (frame.localized()) scan->setPose(mrpt::poses::CPose3D(frame.pose));
	return scan;
}

void insert(DrawnScene& scene, const DrawnObject::Ptr& object, const char* name)
{
	object->setName(name);
	scene.insert(object);
}
}  // namespace

void write_scene(const SceneContent& content, GzipFile& file)
{
	DrawnScene scene;
	insert(scene, grid_object(content), "grid");
	if (!content.names.empty()) insert(scene, names_object(content.names), "map_names");
	insert(scene, hypotheses_object(content.frames), "hypotheses");
	insert(scene, trajectory_object(content.frames.kept()), "trajectory");
	if (content.fused) insert(scene, fused_object(content.frames.kept()), "fused_trajectory");
	if (content.last_scan) insert(scene, scan_object(content), "last_scan");
	file.write(scene);
	file.finish();
}
}  // namespace d2s1r::app
