#!/usr/bin/env bash
# The certificates of a lab in one go: an authority, the machines with rigs, the people and programs that use them.
#
#   bash deploy/make_certificates.sh --lab NAME --out DIR [--days N] [--server NAME[,ALTERNATIVE...]]... [--client ROLE/NAME]...
#
#   bash deploy/make_certificates.sh --lab optics --out ~/optics \
#     --server lab1,192.168.1.20 --client operator/anna --client observer/screen
#
# DIR/authority/ keeps the authority: anyone with its key can make certificates, so keep it off the rigs. It is made by
# the first run; later runs use it, refuse another lab, and replace the certificates that they name.
# DIR/servers/NAME/ goes to that machine: [network] certificates. DIR/clients/NAME/ goes to that person, into
# ~/.config/hapticd/certificates/. The files of a folder change all at once, so that a daemon may read them at any time.
set -euo pipefail
umask 077

usage() {
  sed -n '2,12s/^# \{0,1\}//p' "$0" >&2
  exit 2
}
fail() {
  echo "make_certificates.sh: $*" >&2
  exit 2
}

lab="" out="" days=825
servers=() clients=()
while (($#)); do
  case "$1" in
    --lab) lab="${2:-}"; shift 2 || usage ;;
    --out) out="${2:-}"; shift 2 || usage ;;
    --days) days="${2:-}"; shift 2 || usage ;;
    --server) servers+=("${2:-}"); shift 2 || usage ;;
    --client) clients+=("${2:-}"); shift 2 || usage ;;
    *) usage ;;
  esac
done
[[ "$lab" =~ ^[a-z0-9.-]+$ ]] || fail "--lab: a name of a-z, 0-9, - and ., e.g. optics"
[[ -n "$out" ]] || fail "--out: a folder"
[[ "$days" =~ ^-?[0-9]+$ ]] || fail "--days: a number of days"
((${#servers[@]} + ${#clients[@]})) || fail "nothing to make: name a --server or a --client"

for server in "${servers[@]}"; do
  [[ "$server" =~ ^[A-Za-z0-9.:-]+(,[A-Za-z0-9.:-]+)*$ ]] || fail "--server $server: host names and addresses, separated by commas"
done
for client in "${clients[@]}"; do
  [[ "$client" =~ ^(observer|operator|maintainer|console)/[a-z0-9._-]+$ ]] ||
    fail "--client $client: ROLE/NAME with a role of observer, operator, maintainer, or console for a program, and a name of a-z, 0-9, ., _, -"
done

mkdir -p "$out/authority" "$out/servers" "$out/clients"
authority_key="$out/authority/authority.key" authority="$out/authority/authority.crt"
if [[ ! -e "$authority" ]]; then
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 3650 -sha256 \
    -keyout "$authority_key" -out "$authority" -subj "/O=$lab/CN=hapticd authority of $lab" \
    -addext "basicConstraints=critical,CA:TRUE,pathlen:0" -addext "keyUsage=critical,keyCertSign,cRLSign" 2>/dev/null
  echo "$authority"
fi
# A daemon counts the roles of its own lab only. An authority from elsewhere names none.
of_lab=$(openssl x509 -in "$authority" -noout -subject -nameopt multiline | sed -n 's/^ *commonName *= hapticd authority of //p')
[[ -z "$of_lab" || "$of_lab" == "$lab" ]] ||
  fail "--lab $lab: the authority in $out/authority is that of lab $of_lab: name --lab $of_lab, or another --out for lab $lab"

# make FOLDER FILE_NAME COMMON_NAME USAGE ALTERNATIVE_NAMES
make() {
  local folder="$1" file="$2" work
  work=$(mktemp -d "$out/.new.XXXXXX")
  openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -sha256 -keyout "$work/$file.key" \
    -out "$work/request.csr" -subj "/O=$lab/CN=$3" 2>/dev/null
  printf '%s\n' "basicConstraints=critical,CA:FALSE" "keyUsage=critical,digitalSignature" "extendedKeyUsage=$4" \
    "subjectAltName=$5" >"$work/extensions"
  openssl x509 -req -in "$work/request.csr" -CA "$authority" -CAkey "$authority_key" -sha256 -days "$days" \
    -set_serial "0x$(openssl rand -hex 16)" -extfile "$work/extensions" -out "$work/$file.crt" 2>/dev/null
  rm "$work/request.csr" "$work/extensions"
  cp "$authority" "$work/authority.crt"
  # FOLDER is a link that is exchanged at once: no one sees a key without its certificate.
  local kept
  kept="$folder.$(date +%Y%m%d%H%M%S%N)"
  mv "$work" "$kept"
  ln -sfn "$(basename "$kept")" "$folder.next"
  mv -T "$folder.next" "$folder"
  find "$(dirname "$folder")" -maxdepth 1 -type d -name "$(basename "$folder").[0-9]*" ! -path "$kept" -exec rm -r {} +
  echo "$folder"
}

for server in "${servers[@]}"; do
  names=""
  IFS=, read -r -a parts <<<"$server"
  for part in "${parts[@]}"; do
    if [[ "$part" =~ ^[0-9]+(\.[0-9]+){3}$ || "$part" == *:* ]]; then kind=IP; else kind=DNS; fi
    names+="${names:+,}$kind:$part"
  done
  make "$out/servers/${parts[0]}" server "${parts[0]}" serverAuth "$names"
done
for client in "${clients[@]}"; do
  make "$out/clients/${client#*/}" client "${client#*/}" clientAuth "URI:spiffe://$lab/hapticd/$client"
done
