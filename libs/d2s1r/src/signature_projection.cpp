// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "signature_projection.h"

#include <Eigen/Dense>
#include <algorithm>

namespace d2s1r
{
namespace
{
/// From evenly spaced cells: the axes need not be exact.
Eigen::MatrixXd covariance_of(const SignatureCounts& counts)
{
	constexpr std::size_t kCells = 20000;
	const std::size_t cells = counts.counts.size() / static_cast<std::size_t>(counts.bins);
	const std::size_t step = std::max<std::size_t>(1, cells / kCells);
	Eigen::MatrixXd products = Eigen::MatrixXd::Zero(counts.bins, counts.bins);
	Eigen::VectorXd sum = Eigen::VectorXd::Zero(counts.bins);
	double n = 0;
	for (std::size_t cell = 0; cell < cells; cell += step, n++)
	{
		const Eigen::VectorXd signature =
		    Eigen::Map<const Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 1>>(counts.of(cell), counts.bins)
		        .cast<double>();
		products.noalias() += signature * signature.transpose();
		sum += signature;
	}
	return products / n - sum * sum.transpose() / (n * n);
}
}  // namespace

SignatureProjection::SignatureProjection(const SignatureCounts& counts) : axes_(static_cast<std::size_t>(counts.bins))
{
	const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance_of(counts));  // increasing eigenvalues
	for (int i = 0; i < std::min(kProjectionSize, counts.bins); i++)
		for (int bin = 0; bin < counts.bins; bin++)
			axes_[static_cast<std::size_t>(bin)][static_cast<std::size_t>(i)] =
			    static_cast<float>(solver.eigenvectors()(bin, counts.bins - 1 - i));
}
}  // namespace d2s1r
