#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes a development CA and a server certificate for localhost, 127.0.0.1 and ::1.
#
#   examples/make-certificate.sh DIR
#
# DIR/ca.pem          for clients to trust: curl --cacert DIR/ca.pem https://localhost:8080/
# DIR/server.pem      the server's certificate
# DIR/server-key.pem  its key
#
# An existing CA in DIR is used again, so that a new server certificate needs no change in clients. Not for a robot that others reach.
set -eu

[ $# -eq 1 ] || { echo "usage: $0 DIR" >&2; exit 2; }
dir=$1
umask 077
mkdir -p "$dir"
work=$(mktemp -d "$dir/new.XXXXXX")
trap 'rm -rf "$work"' EXIT

cat >"$work/config" <<CONFIG
[req]
distinguished_name = name
prompt = no
[name]
CN = lrt development CA
[ca]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign, cRLSign
subjectKeyIdentifier = hash
[server]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = serverAuth
subjectAltName = DNS:localhost, IP:127.0.0.1, IP:::1
authorityKeyIdentifier = keyid
CONFIG

if [ ! -f "$dir/ca-key.pem" ] || [ ! -f "$dir/ca.pem" ]; then
  openssl ecparam -name prime256v1 -genkey -noout -out "$work/ca-key.pem"
  openssl req -new -x509 -sha256 -days 3650 -config "$work/config" -extensions ca -key "$work/ca-key.pem" -out "$work/ca.pem"
  mv "$work/ca-key.pem" "$work/ca.pem" "$dir/"
fi
openssl ecparam -name prime256v1 -genkey -noout -out "$work/server-key.pem"
openssl req -new -sha256 -config "$work/config" -subj /CN=localhost -key "$work/server-key.pem" -out "$work/server.csr"
openssl x509 -req -sha256 -days 365 -in "$work/server.csr" -CA "$dir/ca.pem" -CAkey "$dir/ca-key.pem" -set_serial "0x$(openssl rand -hex 8)" \
  -extfile "$work/config" -extensions server -out "$work/server.pem" 2>/dev/null
mv "$work/server-key.pem" "$work/server.pem" "$dir/"
