#pragma once

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "client/cli/session/exit_code.h"
#include "client/cli/terminal/terminal.h"
#include "client/cpp/client.h"

namespace hapticd::cli {

using Json = nlohmann::ordered_json;

/// Shared by all commands: the global options and the exit code.
struct Session {
  std::string server;
  double timeout_s = 5.0;
  bool json = false;
  ExitCode exit_code = ExitCode::kOk;
  std::string certificates{};  ///< folder; empty: where the library looks
  std::string lease_token{};   ///< of a lease that another program keeps
  std::string rigs{};          ///< --rigs: names of several rigs, for the commands that take them
  std::string command_line{};  ///< shown to others as the purpose of a lease

  /// Options with the daemon's address. Throws LocalError if several rigs are named.
  client::ClientOptions options() const;
  /// Throws client::Error.
  client::Client connect() const;
};

/// A problem on this machine, not of a call: a file, a missing program, an argument.
class LocalError : public std::runtime_error {
 public:
  LocalError(const std::string& what, const std::string& where = "", const std::string& value = "",
             const std::string& limit = "", const std::string& remedy = "",
             v1::ErrorReason reason = v1::ERROR_REASON_UNSPECIFIED);
  const v1::ErrorDetail& detail() const noexcept { return detail_; }

 private:
  v1::ErrorDetail detail_;
};

/// --rigs was given to a command that works on one rig.
LocalError no_command_for_rigs();

/// Prints one JSON document on standard output, indented.
void print_json(const Json& document);
/// Prints one JSON document on one line, for streams.
void print_json_line(const Json& document);

/// Bytes of a file that is read as a whole, a table of telemetry at the largest.
inline constexpr std::size_t kMaxTextFile = std::size_t{1} << 30U;
/// Whole text of a file of at most so many bytes; throws LocalError naming it.
std::string read_text_file(const std::string& path, std::size_t max_bytes = kMaxTextFile);

}  // namespace hapticd::cli
