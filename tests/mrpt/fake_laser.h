// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation2DRangeScan.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <thread>

namespace d2s1r::test
{
/// Answers one client as a laser SICK TiM561 does on the network: always with the same scan, as often as it is asked.
class FakeLaser
{
   public:
	explicit FakeLaser(const mrpt::obs::CObservation2DRangeScan& scan) : scan_(telegram(scan))
	{
		sockaddr_in address = {};
		address.sin_family = AF_INET;
		address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
		socklen_t size = sizeof address;
		auto* const general = reinterpret_cast<sockaddr*>(&address);
		if (listener_ < 0 || bind(listener_, general, size) != 0 || listen(listener_, 1) != 0 ||
		    getsockname(listener_, general, &size) != 0)
			throw std::runtime_error("no socket for the laser");
		port_ = ntohs(address.sin_port);
		thread_ = std::thread([this] { serve(); });
	}
	~FakeLaser()
	{
		shutdown(listener_, SHUT_RDWR);  // nobody may have come
		thread_.join();
		close(listener_);
	}
	FakeLaser(const FakeLaser&) = delete;
	FakeLaser& operator=(const FakeLaser&) = delete;

	int port() const { return port_; }

   private:
	/// The text of a scan: ranges [mm] in hexadecimal digits, 65 m where there is no return.
	static std::string telegram(const mrpt::obs::CObservation2DRangeScan& scan)
	{
		std::array<char, 16> word{};
		const auto hexadecimal = [&](unsigned number)
		{
			std::snprintf(word.data(), word.size(), "%X ", number);
			return std::string(word.data());
		};
		std::string text = "\2sRA LMDscandata 1 1 8A 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 DIST1 3F800000 0 0 0 ";
		text += hexadecimal(static_cast<unsigned>(scan.getScanSize()));
		for (std::size_t i = 0; i < scan.getScanSize(); i++)
			text += hexadecimal(
			    scan.getScanRangeValidity(i) ? static_cast<unsigned>(1000 * scan.getScanRange(i)) : 65'000U);
		text += '\3';
		text.resize(16 * 1024, ' ');  // the driver waits until its buffer is full, or for 40 ms
		return text;
	}

	/// Answers commands, each of which ends with the byte 3, until the client goes.
	void serve() const
	{
		const int client = accept(listener_, nullptr, nullptr);
		const std::string ok = "\2sRA " + std::string(94, ' ') + "\3";  // of the length that the driver waits for
		std::string command;
		for (char byte = 0; client >= 0 && recv(client, &byte, 1, 0) == 1;)
		{
			command += byte;
			if (byte != '\3') continue;
			const std::string& answer = command.find("sRN LMDscandata") != std::string::npos ? scan_ : ok;
			if (send(client, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) break;
			command.clear();
		}
		if (client >= 0) close(client);
	}

	std::string scan_;
	int listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	int port_ = 0;
	std::thread thread_;
};
}  // namespace d2s1r::test
