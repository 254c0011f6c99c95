// SPDX-License-Identifier: Apache-2.0
// Node-RED with the flow beside this file: values of robots by MQTT, one command by HTTP. The guide is docs/fleet.md.
//
//   mkdir ~/robots-red && cp flows.json settings.js ~/robots-red
//   node-red --userDir ~/robots-red
//
// Whoever reaches the editor can send what the flow can send. So it listens on this machine only; behind a proxy set adminAuth, and middleware for
// httpNode: https://nodered.org/docs/user-guide/runtime/securing-node-red
module.exports = {
  flowFile: 'flows.json',
  uiHost: '127.0.0.1',
  uiPort: process.env.PORT || 1880,
  credentialSecret: process.env.NODE_RED_SECRET, // encrypts the password of the broker in flows_cred.json
  httpRequestTimeout: 5000, // ms: a robot that does not respond does not keep a command
  telemetry: { enabled: false },
  logging: { console: { level: 'info', metrics: false, audit: false } },
};
