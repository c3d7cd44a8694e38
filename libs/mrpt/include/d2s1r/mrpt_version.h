// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What MRPT 2 and MRPT 3 call differently, under one name. What can be drawn is in mrpt::opengl of MRPT 2 and in
// mrpt::viz of MRPT 3; `#include D2S1R_DRAWING(CSetOfLines.h)` finds a header of it in either.
#if __has_include(<mrpt/viz/Scene.h>)
#define D2S1R_MRPT_3
#define D2S1R_DRAWING(header) <mrpt/viz/header>
#define D2S1R_DRAWING_SCENE <mrpt/viz/Scene.h>
namespace mrpt::viz
{
class CSetOfObjects;
class CVisualObject;
class Scene;
}  // namespace mrpt::viz
#else
#define D2S1R_DRAWING(header) <mrpt/opengl/header>
#define D2S1R_DRAWING_SCENE <mrpt/opengl/COpenGLScene.h>
namespace mrpt::opengl
{
class CRenderizable;
class CSetOfObjects;
#if __has_include(<mrpt/opengl/Scene.h>)  // COpenGLScene is another name of it in later versions of MRPT 2
class Scene;
using COpenGLScene = Scene;
#else
class COpenGLScene;
#endif
}  // namespace mrpt::opengl
#endif

// Later versions of MRPT 2 pack files by zstd, too, and have a class that reads whatever they have packed.
#if __has_include(<mrpt/io/CCompressedInputStream.h>)
#define D2S1R_UNPACKING <mrpt/io/CCompressedInputStream.h>
namespace mrpt::io
{
class CCompressedInputStream;
}
namespace d2s1r
{
using PackedInput = mrpt::io::CCompressedInputStream;
constexpr bool kUnpacksZstd = true;
}  // namespace d2s1r
#else
#define D2S1R_UNPACKING <mrpt/io/CFileGZInputStream.h>
namespace mrpt::io
{
class CFileGZInputStream;
}
namespace d2s1r
{
using PackedInput = mrpt::io::CFileGZInputStream;
constexpr bool kUnpacksZstd = false;
}  // namespace d2s1r
#endif

namespace d2s1r
{
#ifdef D2S1R_MRPT_3
namespace drawing = mrpt::viz;
using DrawnObject = mrpt::viz::CVisualObject;
using DrawnScene = mrpt::viz::Scene;
#else
namespace drawing = mrpt::opengl;
using DrawnObject = mrpt::opengl::CRenderizable;
using DrawnScene = mrpt::opengl::COpenGLScene;
#endif
}  // namespace d2s1r
