#include "server/diagnosis/certificate_findings.h"

#include <fmt/format.h>

#include "server/access/certificate.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::hours kWarnAhead{24 * 30};
constexpr const char* kCertificates = "certificates";

Finding examine_one(const std::string& path, std::chrono::system_clock::time_point now) {
  const auto expiry = expiry_of_certificate(path);
  if (!expiry)
    return {FindingSeverity::kProblem, kCertificates, expiry.error().text(), expiry.error().remedy};
  const auto left = *expiry - now;
  const auto days = std::chrono::duration_cast<std::chrono::hours>(left).count() / 24;
  const char* remedy =
      "make another one (deploy/make_certificates.sh) and copy it there; no restart is needed";
  if (left <= std::chrono::hours(0)) {
    return {FindingSeverity::kProblem, kCertificates, path + " has expired", remedy};
  }
  const bool soon = left <= kWarnAhead;
  return {soon ? FindingSeverity::kWarning : FindingSeverity::kGood, kCertificates,
          fmt::format("{} is valid for {} more days", path, days), soon ? remedy : ""};
}

}  // namespace

Findings examine_certificates(const std::string& folder, std::chrono::system_clock::time_point now) {
  if (folder.empty()) return {};
  const CertificateFiles files = CertificateFiles::in(folder);
  return {examine_one(files.certificate, now), examine_one(files.authority, now)};
}

}  // namespace hapticd::server
