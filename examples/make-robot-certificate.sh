#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes the certificate of a robot for its broker, signed by the CA that examples/make-certificate.sh has made in DIR.
#
#   examples/make-robot-certificate.sh DIR NAME [IRI [DAYS]]
#
# NAME  the CN: the robot's user at the broker, and the level below robots/ of its topics
# IRI   lrt::Identity::iri, which the certificate names as URI; default: urn:lrt:NAME
# DAYS  how long it is valid; default: 90. With 0 it has expired when it is made, to see what then happens
#
# DIR/NAME.pem      the certificate
# DIR/NAME-key.pem  its key
# Files are replaced at once, so a robot that reloads them never reads a half one. The key goes to the robot over a trusted way, and to nobody else.
set -eu

if [ $# -lt 2 ] || [ $# -gt 4 ]; then
  echo "usage: $0 DIR NAME [IRI [DAYS]]" >&2
  exit 2
fi
dir=$1
name=$2
iri=${3:-urn:lrt:$name}
days=${4:-90}
case $name in
  *[!A-Za-z0-9._-]* | '') echo "$0: expected a NAME of letters, digits, '.', '_' and '-', found \"$name\"" >&2; exit 2 ;;
esac
case $name in
  ca | server | ca-key | server-key | *-key) echo "$0: \"$name\" is the name of a file of the broker" >&2; exit 2 ;;
esac
case $iri in
  *[!A-Za-z0-9._~:/?\&=%@-]*) echo "$0: expected an IRI without spaces, commas, '#' and quotes, found \"$iri\"" >&2; exit 2 ;;
esac
case $days in
  *[!0-9]* | '') echo "$0: expected DAYS as a number, found \"$days\"" >&2; exit 2 ;;
esac
[ -f "$dir/ca-key.pem" ] || { echo "$0: there is no CA in \"$dir\": make one with examples/make-certificate.sh" >&2; exit 1; }
umask 077
work=$(mktemp -d "$dir/new.XXXXXX")
trap 'rm -rf "$work"' EXIT

cat >"$work/config" <<CONFIG
[req]
distinguished_name = name
prompt = no
[name]
CN = $name
[robot]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = clientAuth
subjectAltName = URI:$iri
authorityKeyIdentifier = keyid
[ca]
default_ca = own
[own]
database = $work/index
new_certs_dir = $work
rand_serial = yes
default_md = sha256
policy = any
unique_subject = no
[any]
commonName = supplied
CONFIG

: >"$work/index"
# openssl ca, because openssl x509 cannot make a certificate that has expired
seconds() { date -u -d "@$1" +%Y%m%d%H%M%SZ; }
now=$(date +%s)
if [ "$days" -eq 0 ]; then
  begin=$(seconds $((now - 7200)))
  end=$(seconds $((now - 3600)))
else
  begin=$(seconds $((now - 3600)))
  end=$(seconds $((now + days * 86400)))
fi
openssl ecparam -name prime256v1 -genkey -noout -out "$work/robot-key.pem"
openssl req -new -sha256 -config "$work/config" -key "$work/robot-key.pem" -out "$work/robot.csr"
openssl ca -batch -notext -config "$work/config" -cert "$dir/ca.pem" -keyfile "$dir/ca-key.pem" -in "$work/robot.csr" -out "$work/robot.pem" \
  -extensions robot -startdate "$begin" -enddate "$end" 2>"$work/log" || { cat "$work/log" >&2; exit 1; }
mv "$work/robot-key.pem" "$dir/$name-key.pem"
mv "$work/robot.pem" "$dir/$name.pem"
