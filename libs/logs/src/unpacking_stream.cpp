// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "unpacking_stream.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <thread>

#include "unpacker.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::size_t kBytesOfMagic = 4;  // [byte] by which a file is known to be packed, at most

class UnpackingStream : public InputStream
{
   public:
	UnpackingStream(int descriptor, bool follows) : descriptor_(descriptor), follows_(follows) {}
	~UnpackingStream() override { close(descriptor_); }

	std::size_t read(void* buffer, std::size_t count) override
	{
		if (!has_started_) start();
		auto* const to = static_cast<std::uint8_t*>(buffer);
		std::size_t got = 0;
		while (got < count)
		{
			const std::size_t more = unpacker_ ? unpack(to + got, count - got) : take(to + got, count - got);
			if (more == 0) break;
			got += more;
		}
		if (got == 0 && count > 0 && unpacker_ && unpacker_->is_within_part()) throw CutShort();
		return got;
	}

   private:
	void start()
	{
		has_started_ = true;
		while (end_ <= kBytesOfMagic && fill())
			;
		const std::string method = method_of({block_.data(), end_});
		if (!method.empty()) unpacker_ = make_unpacker(method);
		first_byte_ = block_.front();
	}

	/// Waits for bytes and puts them behind those in the block. Returns whether any came.
	bool fill()
	{
		if (begin_ == end_) begin_ = end_ = 0;
		for (;;)
		{
			const ssize_t got = ::read(descriptor_, block_.data() + end_, block_.size() - end_);
			if (got < 0 && errno == EINTR) continue;
			if (got < 0) throw ReadError(std::strerror(errno));
			if (got > 0) end_ += static_cast<std::size_t>(got);
			if (got != 0 || !waits()) return got > 0;
		}
	}

	/// Waits for a file to grow. Returns whether it may have. \throws BecameShorter
	bool waits() const
	{
		constexpr std::chrono::milliseconds kPause(2);
		struct stat file = {};
		if (!follows_ || fstat(descriptor_, &file) != 0 || file.st_nlink == 0) return false;
		if (file.st_size < lseek(descriptor_, 0, SEEK_CUR)) throw BecameShorter();
		std::this_thread::sleep_for(kPause);
		return true;
	}

	std::size_t take(std::uint8_t* to, std::size_t count)
	{
		if (begin_ == end_ && !fill()) return 0;
		const std::size_t taken = std::min(count, end_ - begin_);
		std::memcpy(to, block_.data() + begin_, taken);
		begin_ += taken;
		return taken;
	}

	std::size_t unpack(std::uint8_t* to, std::size_t count)
	{
		std::size_t got = 0;
		while (got == 0)
		{
			if (begin_ == end_ && !unpacker_->may_hold_more() && !fill()) return 0;
			// gzip, too, ignores what else is behind the last part
			if (!unpacker_->is_within_part() && block_[begin_] != first_byte_) return 0;
			Bytes input = {block_.data() + begin_, end_ - begin_};
			got = unpacker_->unpack(input, to, count);
			begin_ = end_ - input.size;
		}
		return got;
	}

	int descriptor_;
	bool follows_;
	bool has_started_ = false;
	std::unique_ptr<Unpacker> unpacker_;  //!< null: not packed
	std::uint8_t first_byte_ = 0;         //!< of each part
	std::array<std::uint8_t, 1 << 16> block_{};
	std::size_t begin_ = 0, end_ = 0;  //!< [byte] of what is still to be used in the block
};
}  // namespace

std::unique_ptr<InputStream> unpack(int descriptor, bool follows)
{
	return std::make_unique<UnpackingStream>(descriptor, follows);
}

std::unique_ptr<InputStream> open_unpacked(const std::string& path)
{
	const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
	if (descriptor < 0) throw cannot_open(path);
	return unpack(descriptor, false);
}

std::string read_unpacked_start(const std::string& path, std::size_t size)
{
	std::string start(size, '\0');
	start.resize(open_unpacked(path)->read(start.data(), size));
	return start;
}
}  // namespace d2s1r::logs
