#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace hapticd::server {

/// What a client may do. Each role may do what those before it may.
enum class Role : std::uint8_t {
  kNone,  ///< identified, but without a role: may stop, and ask who it is
  kObserver,
  kOperator,
  kMaintainer,
  kConsole,  ///< of calls: needs a console, see Identity::is_console. No identity has it
};

/// Rule that says when a command needs a lease.
enum class LeaseRule : std::uint8_t {
  kByConnection,  ///< when taken from this machine, required from elsewhere
  kWhenTaken,     ///< only while some client holds one
  kRequired,
};

/// Rights of clients: [access] of the configuration.
struct AccessConfig {
  LeaseRule lease = LeaseRule::kByConnection;
  double take_notice_s = 3.0;           ///< how long a holder keeps a lease that is being taken
  Role local_role = Role::kMaintainer;  ///< of users of this machine whom nothing below names
  /// Lab of the certificates whose roles count. Empty: the organisation of the daemon's own certificate,
  /// which is what make_certificates.sh writes there.
  std::string lab;
  std::string unix_socket_group;       ///< may open the unix socket; empty = the daemon's own group
  std::map<std::string, Role> users;   ///< [access.users], of this machine
  std::map<std::string, Role> groups;  ///< [access.groups], of this machine
  std::map<std::string, Role>
      certificates;  ///< [access.certificates], in the place of the certificate's role
  std::map<std::string, std::string> denied;  ///< [access.denied]: identity → why; may do nothing

  // For one identity; stops do not count.
  double max_calls = 400.0;  ///< calls and streams at once
  double max_calls_per_s = 10'000.0;

  std::string audit_file;       ///< [access] audit_file; empty = none
  double audit_file_mb = 10.0;  ///< begins a new file beyond this size; five are kept
  bool audit_journal = false;   ///< to the journal of systemd as well
};

}  // namespace hapticd::server
