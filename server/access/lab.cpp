#include "server/access/lab.h"

#include "server/access/certificate.h"
#include "server/process/log.h"

namespace hapticd::server {

AccessConfig with_lab(AccessConfig access, const std::string& certificates) {
  if (!access.lab.empty() || certificates.empty()) return access;
  access.lab = organisation_of_certificate(CertificateFiles::in(certificates).certificate);
  if (access.lab.empty()) {
    log_warning(
        "no lab (O) can be read from the daemon's certificate: certificates of every lab under its authority "
        "have the role that they name; set [access] lab");
  }
  return access;
}

}  // namespace hapticd::server
