#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <string_view>

namespace hapticd::replay {

/// The lines of a text file, read once from front to back in bounded memory. A line ends with LF, CR LF or
/// CR. The text may be UTF-8, or UTF-16 of either byte order, which is handed on as UTF-8; a byte order mark
/// is taken away.
class TextLines {
 public:
  static constexpr std::size_t kMaxLineBytes = 65'536;

  enum class State : unsigned char { kLine, kEnd, kTooLong, kFailed };

  /// False if the file cannot be opened.
  bool open(const std::string& path);
  /// Reads the next line without its end; valid until the next call.
  State next(std::string_view& line);
  /// Number of the last line, from 1.
  std::size_t number() const noexcept { return number_; }
  /// True if the last line ended with the file, not with a line end: it may have been cut.
  bool is_unfinished() const noexcept { return is_unfinished_; }

 private:
  enum class Encoding : unsigned char { kUtf8, kUtf16Little, kUtf16Big };

  bool fill();  ///< Returns false at the end of the file.
  void append_utf16(std::string_view bytes);

  std::ifstream stream_;
  Encoding encoding_ = Encoding::kUtf8;
  std::string text_;  ///< decoded, from the line that is next
  std::size_t begin_ = 0;
  std::string undecoded_;  ///< half a character of UTF-16
  bool is_first_ = true;
  bool skips_line_feed_ = false;  ///< the second byte of CR LF is still to come
  bool is_unfinished_ = false;
  std::size_t number_ = 0;
};

}  // namespace hapticd::replay
