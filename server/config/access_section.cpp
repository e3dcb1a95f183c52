#include "server/config/access_section.h"

#include <fmt/format.h>

#include "server/config/config_words.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kNoticeS{0.0, 10.0, "s"};
constexpr Range kCalls{16.0, 10'000.0, "calls"};
constexpr Range kCallsPerS{10.0, 1e6, "calls/s"};
constexpr Range kFileMb{0.1, 1000.0, "MB"};

void read_roles(TomlTable table, std::map<std::string, Role>& roles) {
  for (const std::string& name : table.keys()) {
    Role role = Role::kNone;
    table.read(name, role, kRoleWords);
    roles[name] = role;
  }
}

std::string write_roles(std::string_view name, const std::map<std::string, Role>& roles) {
  std::string text = fmt::format("\n[access.{}]\n", name);
  for (const auto& [key, role] : roles) {
    text += fmt::format("{} = {}\n", toml_quoted(key), toml_quoted(text_of(role, kRoleWords)));
  }
  return text;
}

}  // namespace

void read_access(TomlTable table, AccessConfig& access) {
  table.read("lease", access.lease, kLeaseWords);
  table.read("take_notice_s", access.take_notice_s, kNoticeS);
  table.read("local_role", access.local_role, kRoleWords);
  table.read("lab", access.lab, 200);
  table.read("unix_socket_group", access.unix_socket_group, 64);
  table.read("max_calls", access.max_calls, kCalls);
  table.read("max_calls_per_s", access.max_calls_per_s, kCallsPerS);
  table.read("audit_file", access.audit_file, 4096);
  table.read("audit_file_mb", access.audit_file_mb, kFileMb);
  table.read("audit_journal", access.audit_journal);
  read_roles(table.table("users"), access.users);
  read_roles(table.table("groups"), access.groups);
  read_roles(table.table("certificates"), access.certificates);
  TomlTable denied = table.table("denied");
  for (const std::string& identity : denied.keys()) denied.read(identity, access.denied[identity], 200);
}

std::string write_access(const AccessConfig& access) {
  std::string text = fmt::format(
      "\n[access]\nlease = {}\ntake_notice_s = {}\nlocal_role = {}\nlab = {}\nunix_socket_group = "
      "{}\nmax_calls = {}\n"
      "max_calls_per_s = {}\naudit_file = {}\naudit_file_mb = {}\naudit_journal = {}\n",
      toml_quoted(text_of(access.lease, kLeaseWords)), toml_number(access.take_notice_s),
      toml_quoted(text_of(access.local_role, kRoleWords)), toml_quoted(access.lab),
      toml_quoted(access.unix_socket_group), toml_number(access.max_calls),
      toml_number(access.max_calls_per_s), toml_quoted(access.audit_file), toml_number(access.audit_file_mb),
      access.audit_journal);
  text += write_roles("users", access.users) + write_roles("groups", access.groups) +
          write_roles("certificates", access.certificates) + "\n[access.denied]\n";
  for (const auto& [identity, why] : access.denied) {
    text += fmt::format("{} = {}\n", toml_quoted(identity), toml_quoted(why));
  }
  return text;
}

}  // namespace hapticd::server
