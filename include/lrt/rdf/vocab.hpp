// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/iri.hpp>

/// The vocabulary terms that lrt uses, spelled as in their vocabularies (R1.5, SPEC section 4). Each vocabulary is a
/// namespace with the name of its usual prefix. The prefixes rdf, unit and lrt are namespaces of lrt already; these
/// vocabularies are rdf_, unit_ and lrt_.
///
/// @par Threads  Any: they are constants.
namespace lrt::vocab {
inline namespace v0 {

#define LRT_TERM(prefix, name) \
  inline constexpr Iri name { LRT_VOCAB_##prefix #name }
#define LRT_TERM_AS(prefix, cpp, name) \
  inline constexpr Iri cpp { LRT_VOCAB_##prefix name }

#define LRT_VOCAB_rdf "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
namespace rdf_ {
LRT_TERM(rdf, type);
LRT_TERM(rdf, value);
LRT_TERM(rdf, first);
LRT_TERM(rdf, rest);
LRT_TERM(rdf, nil);
LRT_TERM(rdf, List);
LRT_TERM(rdf, Property);
LRT_TERM(rdf, langString);
LRT_TERM(rdf, Seq);
}  // namespace rdf_

#define LRT_VOCAB_rdfs "http://www.w3.org/2000/01/rdf-schema#"
namespace rdfs {
LRT_TERM(rdfs, label);
LRT_TERM(rdfs, comment);
LRT_TERM(rdfs, seeAlso);
LRT_TERM(rdfs, isDefinedBy);
LRT_TERM(rdfs, subClassOf);
LRT_TERM(rdfs, Class);
LRT_TERM(rdfs, domain);
LRT_TERM(rdfs, range);
LRT_TERM(rdfs, Resource);
}  // namespace rdfs

#define LRT_VOCAB_owl "http://www.w3.org/2002/07/owl#"
namespace owl {
LRT_TERM(owl, Ontology);
}  // namespace owl

#define LRT_VOCAB_xsd "http://www.w3.org/2001/XMLSchema#"
namespace xsd {
LRT_TERM(xsd, string);
LRT_TERM(xsd, boolean);
LRT_TERM(xsd, integer);
LRT_TERM(xsd, decimal);
LRT_TERM_AS(xsd, float_, "float");
LRT_TERM_AS(xsd, double_, "double");
LRT_TERM_AS(xsd, byte_, "byte");
LRT_TERM_AS(xsd, short_, "short");
LRT_TERM_AS(xsd, int_, "int");
LRT_TERM_AS(xsd, long_, "long");
LRT_TERM(xsd, unsignedByte);
LRT_TERM(xsd, unsignedShort);
LRT_TERM(xsd, unsignedInt);
LRT_TERM(xsd, unsignedLong);
LRT_TERM(xsd, nonNegativeInteger);
LRT_TERM(xsd, dateTime);
LRT_TERM(xsd, dayTimeDuration);
LRT_TERM(xsd, duration);
LRT_TERM(xsd, anyURI);
LRT_TERM(xsd, base64Binary);
}  // namespace xsd

#define LRT_VOCAB_dcterms "http://purl.org/dc/terms/"
namespace dcterms {
LRT_TERM(dcterms, title);
LRT_TERM(dcterms, type);
LRT_TERM(dcterms, description);
LRT_TERM(dcterms, identifier);
LRT_TERM(dcterms, modified);
LRT_TERM(dcterms, created);
LRT_TERM(dcterms, format);
LRT_TERM(dcterms, conformsTo);
LRT_TERM(dcterms, hasPart);
LRT_TERM(dcterms, isPartOf);
LRT_TERM(dcterms, hasFormat);
}  // namespace dcterms

#define LRT_VOCAB_dcat "http://www.w3.org/ns/dcat#"
namespace dcat {
LRT_TERM(dcat, Distribution);
LRT_TERM(dcat, byteSize);
LRT_TERM(dcat, downloadURL);
LRT_TERM(dcat, mediaType);
}  // namespace dcat

#define LRT_VOCAB_ldp "http://www.w3.org/ns/ldp#"
namespace ldp {
LRT_TERM(ldp, Resource);
LRT_TERM(ldp, RDFSource);
LRT_TERM(ldp, Container);
LRT_TERM(ldp, BasicContainer);
LRT_TERM(ldp, contains);
LRT_TERM(ldp, constrainedBy);
LRT_TERM(ldp, PreferMinimalContainer);
LRT_TERM(ldp, PreferContainment);
}  // namespace ldp

#define LRT_VOCAB_schema "http://schema.org/"
namespace schema {
LRT_TERM(schema, PropertyValue);
LRT_TERM(schema, name);
LRT_TERM(schema, value);
LRT_TERM(schema, dateModified);
LRT_TERM(schema, IndividualProduct);
LRT_TERM(schema, serialNumber);
LRT_TERM(schema, model);
LRT_TERM(schema, manufacturer);
LRT_TERM(schema, softwareVersion);
}  // namespace schema

#define LRT_VOCAB_prov "http://www.w3.org/ns/prov#"
namespace prov {
LRT_TERM(prov, Activity);
LRT_TERM(prov, startedAtTime);
LRT_TERM(prov, endedAtTime);
}  // namespace prov

#define LRT_VOCAB_sd "http://www.w3.org/ns/sparql-service-description#"
namespace sd {
LRT_TERM(sd, Service);
LRT_TERM(sd, Dataset);
LRT_TERM(sd, Graph);
LRT_TERM(sd, SPARQL11Query);
LRT_TERM(sd, UnionDefaultGraph);
LRT_TERM(sd, defaultDataset);
LRT_TERM(sd, defaultGraph);
LRT_TERM(sd, endpoint);
LRT_TERM(sd, feature);
LRT_TERM(sd, resultFormat);
LRT_TERM(sd, supportedLanguage);
}  // namespace sd

#define LRT_VOCAB_sh "http://www.w3.org/ns/shacl#"
namespace sh {
LRT_TERM(sh, NodeShape);
LRT_TERM(sh, PropertyShape);
LRT_TERM(sh, property);
LRT_TERM(sh, path);
LRT_TERM(sh, node);
LRT_TERM(sh, datatype);
LRT_TERM(sh, minCount);
LRT_TERM(sh, maxCount);
LRT_TERM(sh, minInclusive);
LRT_TERM(sh, minExclusive);
LRT_TERM(sh, maxInclusive);
LRT_TERM(sh, maxExclusive);
LRT_TERM(sh, minLength);
LRT_TERM(sh, maxLength);
LRT_TERM(sh, hasValue);
LRT_TERM(sh, nodeKind);
LRT_TERM(sh, targetNode);
LRT_TERM(sh, targetClass);
LRT_TERM_AS(sh, class_, "class");
LRT_TERM_AS(sh, in_, "in");
LRT_TERM_AS(sh, or_, "or");
LRT_TERM(sh, name);
LRT_TERM(sh, description);
LRT_TERM(sh, defaultValue);
LRT_TERM(sh, resultMessage);
LRT_TERM(sh, IRI);
LRT_TERM(sh, BlankNode);
LRT_TERM(sh, Literal);
LRT_TERM(sh, Shape);
LRT_TERM(sh, targetSubjectsOf);
LRT_TERM(sh, targetObjectsOf);
LRT_TERM(sh, severity);
LRT_TERM(sh, message);
LRT_TERM(sh, deactivated);
LRT_TERM(sh, pattern);
LRT_TERM(sh, flags);
LRT_TERM(sh, languageIn);
LRT_TERM(sh, uniqueLang);
LRT_TERM(sh, equals);
LRT_TERM(sh, disjoint);
LRT_TERM(sh, lessThan);
LRT_TERM(sh, lessThanOrEquals);
LRT_TERM(sh, qualifiedValueShape);
LRT_TERM(sh, qualifiedValueShapesDisjoint);
LRT_TERM(sh, qualifiedMinCount);
LRT_TERM(sh, qualifiedMaxCount);
LRT_TERM(sh, closed);
LRT_TERM(sh, ignoredProperties);
LRT_TERM(sh, alternativePath);
LRT_TERM(sh, inversePath);
LRT_TERM(sh, zeroOrMorePath);
LRT_TERM(sh, oneOrMorePath);
LRT_TERM(sh, zeroOrOnePath);
LRT_TERM(sh, xone);
LRT_TERM(sh, ValidationReport);
LRT_TERM(sh, ValidationResult);
LRT_TERM(sh, conforms);
LRT_TERM(sh, result);
LRT_TERM(sh, focusNode);
LRT_TERM(sh, resultPath);
LRT_TERM(sh, value);
LRT_TERM(sh, sourceShape);
LRT_TERM(sh, sourceConstraintComponent);
LRT_TERM(sh, resultSeverity);
LRT_TERM(sh, detail);
LRT_TERM(sh, Violation);
LRT_TERM(sh, Warning);
LRT_TERM(sh, Info);
LRT_TERM(sh, BlankNodeOrIRI);
LRT_TERM(sh, BlankNodeOrLiteral);
LRT_TERM(sh, IRIOrLiteral);
LRT_TERM(sh, sparql);
LRT_TERM(sh, js);
LRT_TERM(sh, target);
LRT_TERM(sh, expression);
LRT_TERM(sh, entailment);
LRT_TERM(sh, ConstraintComponent);
LRT_TERM(sh, parameter);
LRT_TERM(sh, ClassConstraintComponent);
LRT_TERM(sh, DatatypeConstraintComponent);
LRT_TERM(sh, NodeKindConstraintComponent);
LRT_TERM(sh, MinCountConstraintComponent);
LRT_TERM(sh, MaxCountConstraintComponent);
LRT_TERM(sh, MinExclusiveConstraintComponent);
LRT_TERM(sh, MinInclusiveConstraintComponent);
LRT_TERM(sh, MaxExclusiveConstraintComponent);
LRT_TERM(sh, MaxInclusiveConstraintComponent);
LRT_TERM(sh, MinLengthConstraintComponent);
LRT_TERM(sh, MaxLengthConstraintComponent);
LRT_TERM(sh, PatternConstraintComponent);
LRT_TERM(sh, LanguageInConstraintComponent);
LRT_TERM(sh, UniqueLangConstraintComponent);
LRT_TERM(sh, EqualsConstraintComponent);
LRT_TERM(sh, DisjointConstraintComponent);
LRT_TERM(sh, LessThanConstraintComponent);
LRT_TERM(sh, LessThanOrEqualsConstraintComponent);
LRT_TERM(sh, NotConstraintComponent);
LRT_TERM(sh, AndConstraintComponent);
LRT_TERM(sh, OrConstraintComponent);
LRT_TERM(sh, XoneConstraintComponent);
LRT_TERM(sh, NodeConstraintComponent);
LRT_TERM(sh, PropertyConstraintComponent);
LRT_TERM(sh, QualifiedMinCountConstraintComponent);
LRT_TERM(sh, QualifiedMaxCountConstraintComponent);
LRT_TERM(sh, ClosedConstraintComponent);
LRT_TERM(sh, HasValueConstraintComponent);
LRT_TERM(sh, InConstraintComponent);
LRT_TERM_AS(sh, not_, "not");
LRT_TERM_AS(sh, and_, "and");
}  // namespace sh

#define LRT_VOCAB_qudt "http://qudt.org/schema/qudt/"
namespace qudt {
LRT_TERM(qudt, hasUnit);
LRT_TERM(qudt, unit);  // the former name of hasUnit
LRT_TERM(qudt, hasQuantityKind);
LRT_TERM(qudt, dataType);  // no longer in the schema; servers of others may state it
}  // namespace qudt

#define LRT_VOCAB_quantitykind "http://qudt.org/vocab/quantitykind/"
namespace quantitykind {
LRT_TERM(quantitykind, Angle);
LRT_TERM(quantitykind, AngularVelocity);
LRT_TERM(quantitykind, Length);
LRT_TERM(quantitykind, Velocity);
LRT_TERM(quantitykind, Time);
LRT_TERM(quantitykind, Frequency);
LRT_TERM(quantitykind, Force);
LRT_TERM(quantitykind, Torque);
LRT_TERM(quantitykind, Mass);
LRT_TERM(quantitykind, MomentOfInertia);
LRT_TERM(quantitykind, Temperature);
LRT_TERM(quantitykind, Voltage);
LRT_TERM(quantitykind, ElectricCurrent);
}  // namespace quantitykind

#define LRT_VOCAB_unit "http://qudt.org/vocab/unit/"
namespace unit_ {
LRT_TERM(unit, RAD);
LRT_TERM(unit, DEG);
LRT_TERM(unit, M);
LRT_TERM_AS(unit, MilliM, "MilliM");
LRT_TERM_AS(unit, SEC, "SEC");
LRT_TERM_AS(unit, M_PER_SEC, "M-PER-SEC");
LRT_TERM_AS(unit, RAD_PER_SEC, "RAD-PER-SEC");
LRT_TERM_AS(unit, DEG_PER_SEC, "DEG-PER-SEC");
LRT_TERM_AS(unit, N, "N");
LRT_TERM_AS(unit, N_M, "N-M");
LRT_TERM_AS(unit, KiloGM, "KiloGM");
LRT_TERM_AS(unit, DEG_C, "DEG_C");
LRT_TERM_AS(unit, V, "V");
LRT_TERM_AS(unit, A, "A");
LRT_TERM_AS(unit, PERCENT, "PERCENT");
LRT_TERM_AS(unit, UNITLESS, "UNITLESS");
}  // namespace unit_

#define LRT_VOCAB_hybrit "https://hybr-it-projekt.de/ns/hybr-it#"
namespace hybrit {
LRT_TERM(hybrit, RoboticThing);
LRT_TERM(hybrit, Property);
LRT_TERM(hybrit, Action);
LRT_TERM(hybrit, AsynchronousAction);
LRT_TERM(hybrit, Subscription);
LRT_TERM(hybrit, WebCallback);
LRT_TERM(hybrit, WebSocket);
LRT_TERM(hybrit, property);
LRT_TERM(hybrit, action);
LRT_TERM(hybrit, blueprint);
LRT_TERM(hybrit, subscriptions);
LRT_TERM(hybrit, binding);
LRT_TERM(hybrit, consumes);
LRT_TERM(hybrit, produces);
LRT_TERM(hybrit, onResource);
LRT_TERM(hybrit, callbackURL);
LRT_TERM(hybrit, mediaType);
LRT_TERM(hybrit, websocketUrl);
}  // namespace hybrit

#define LRT_VOCAB_vom "http://vocab.arvida.de/2015/06/vom/vocab#"
namespace vom {
LRT_TERM(vom, numericalValue);
LRT_TERM(vom, unit);
LRT_TERM(vom, quantityValue);
LRT_TERM(vom, quantityKind);
LRT_TERM(vom, Length);
LRT_TERM(vom, Angle);
}  // namespace vom

#define LRT_VOCAB_maths "http://vocab.arvida.de/2015/06/maths/vocab#"
namespace maths {
LRT_TERM(maths, Scalar);
LRT_TERM(maths, Vector2D);
LRT_TERM(maths, Vector3D);
LRT_TERM(maths, Vector4D);
LRT_TERM(maths, Quaternion);
LRT_TERM(maths, CoordinateSystem);
LRT_TERM(maths, x);
LRT_TERM(maths, y);
LRT_TERM(maths, z);
LRT_TERM(maths, w);
LRT_TERM(maths, Radian);
LRT_TERM(maths, Degree);
}  // namespace maths

#define LRT_VOCAB_spatial "http://vocab.arvida.de/2015/06/spatial/vocab#"
namespace spatial {
LRT_TERM(spatial, AxisAngle);
LRT_TERM(spatial, Rotation3D);
LRT_TERM(spatial, rotationAngle);
LRT_TERM(spatial, rotationAxis);
LRT_TERM(spatial, Translation3D);
LRT_TERM(spatial, SpatialRelationship);
LRT_TERM(spatial, translation);
LRT_TERM(spatial, rotation);
LRT_TERM(spatial, sourceCoordinateSystem);
LRT_TERM(spatial, targetCoordinateSystem);
LRT_TERM(spatial, spatialRelationship);
LRT_TERM(spatial, scaling);
}  // namespace spatial

#define LRT_VOCAB_ros "http://ros.org/#"
namespace ros {
LRT_TERM(ros, Robot);
LRT_TERM(ros, Joint);
LRT_TERM(ros, RevoluteJoint);
LRT_TERM(ros, ContinuousJoint);
LRT_TERM(ros, PrismaticJoint);
LRT_TERM(ros, FixedJoint);
LRT_TERM(ros, FloatingJoint);
LRT_TERM(ros, PlanarJoint);
LRT_TERM(ros, Link);
LRT_TERM(ros, position);
LRT_TERM(ros, velocity);
LRT_TERM(ros, effort);
LRT_TERM(ros, rotation);
LRT_TERM(ros, friction);
LRT_TERM(ros, jointReferenceFrame);
LRT_TERM(ros, preceedingLink);
LRT_TERM(ros, succeedingLink);
}  // namespace ros

#define LRT_VOCAB_xhv "http://www.w3.org/1999/xhtml/vocab#"
namespace xhv {
LRT_TERM(xhv, prev);
LRT_TERM(xhv, next);
}  // namespace xhv

#define LRT_VOCAB_http_core "http://www.w3.org/2011/http#"
namespace http_core {
LRT_TERM(http_core, Request);
LRT_TERM(http_core, mthd);
LRT_TERM(http_core, requestURI);
LRT_TERM(http_core, body);
LRT_TERM(http_core, Response);
LRT_TERM(http_core, statusCodeValue);
LRT_TERM(http_core, reasonPhrase);
LRT_TERM(http_core, headers);
LRT_TERM(http_core, RequestHeader);
LRT_TERM(http_core, EntityHeader);
LRT_TERM(http_core, GeneralHeader);
LRT_TERM(http_core, fieldName);
LRT_TERM(http_core, fieldValue);
}  // namespace http_core

#define LRT_VOCAB_http_methods "http://www.w3.org/2011/http-methods#"
namespace http_methods {
LRT_TERM(http_methods, GET);
LRT_TERM(http_methods, POST);
LRT_TERM(http_methods, PUT);
LRT_TERM(http_methods, DELETE);
}  // namespace http_methods

#define LRT_VOCAB_sosa "http://www.w3.org/ns/sosa/"
namespace sosa {
LRT_TERM(sosa, forProperty);
}

#define LRT_VOCAB_ssn "http://www.w3.org/ns/ssn/"
namespace ssn {
LRT_TERM(ssn, forProperty);  // the former name of sosa:forProperty
}

#define LRT_VOCAB_acl "http://www.w3.org/ns/auth/acl#"
namespace acl {
LRT_TERM(acl, Authorization);
LRT_TERM(acl, accessTo);
LRT_TERM_AS(acl, default_, "default");
LRT_TERM(acl, agent);
LRT_TERM(acl, agentGroup);
LRT_TERM(acl, agentClass);
LRT_TERM(acl, AuthenticatedAgent);
LRT_TERM(acl, mode);
LRT_TERM(acl, Read);
LRT_TERM(acl, Write);
LRT_TERM(acl, Control);
}  // namespace acl

#define LRT_VOCAB_foaf "http://xmlns.com/foaf/0.1/"
namespace foaf {
LRT_TERM(foaf, Agent);
}

#define LRT_VOCAB_lrt "https://w3id.org/lrt/ns#"
namespace lrt_ {
LRT_TERM(lrt, state);
LRT_TERM(lrt, Invocation);
LRT_TERM(lrt, invocation);
LRT_TERM(lrt, status);
LRT_TERM(lrt, pending);
LRT_TERM(lrt, running);
LRT_TERM(lrt, succeeded);
LRT_TERM(lrt, failed);
LRT_TERM(lrt, cancelled);
LRT_TERM(lrt, progress);
LRT_TERM(lrt, error);
LRT_TERM(lrt, input);
LRT_TERM(lrt, result);
LRT_TERM(lrt, policy);
LRT_TERM(lrt, collection);
LRT_TERM(lrt, World);
LRT_TERM(lrt, WorldGraph);
LRT_TERM(lrt, allGraphs);
LRT_TERM(lrt, matrix);
LRT_TERM(lrt, frame);
LRT_TERM(lrt, pose);
LRT_TERM(lrt, rootLink);
LRT_TERM(lrt, positionsOf);
LRT_TERM(lrt, mimics);
LRT_TERM(lrt, mesh);
LRT_TERM(lrt, texture);
LRT_TERM(lrt, positions);
LRT_TERM(lrt, limits);
LRT_TERM(lrt, dynamics);
LRT_TERM(lrt, safety);
LRT_TERM(lrt, axis);
LRT_TERM(lrt, mimic);
LRT_TERM(lrt, JointLimits);
LRT_TERM(lrt, lowerLimit);
LRT_TERM(lrt, upperLimit);
LRT_TERM(lrt, velocityLimit);
LRT_TERM(lrt, effortLimit);
LRT_TERM(lrt, JointDynamics);
LRT_TERM(lrt, damping);
LRT_TERM(lrt, staticFriction);
LRT_TERM(lrt, SafetyLimits);
LRT_TERM(lrt, softLowerLimit);
LRT_TERM(lrt, softUpperLimit);
LRT_TERM(lrt, positionGain);
LRT_TERM(lrt, velocityGain);
LRT_TERM(lrt, MimicRule);
LRT_TERM(lrt, multiplier);
LRT_TERM(lrt, offset);
LRT_TERM(lrt, inertial);
LRT_TERM(lrt, visual);
LRT_TERM(lrt, collision);
LRT_TERM(lrt, Inertia);
LRT_TERM(lrt, mass);
LRT_TERM(lrt, ixx);
LRT_TERM(lrt, ixy);
LRT_TERM(lrt, ixz);
LRT_TERM(lrt, iyy);
LRT_TERM(lrt, iyz);
LRT_TERM(lrt, izz);
LRT_TERM(lrt, Geometry);
LRT_TERM(lrt, geometryType);
LRT_TERM(lrt, size);
LRT_TERM(lrt, radius);
LRT_TERM(lrt, length);
LRT_TERM(lrt, materialName);
LRT_TERM(lrt, colour);
LRT_TERM(lrt, file);
LRT_TERM(lrt, EventStream);
LRT_TERM(lrt, Feed);
LRT_TERM(lrt, mqttBroker);
LRT_TERM(lrt, mqttTopic);
LRT_TERM(lrt, mqttCommandTopic);
LRT_TERM(lrt, delivery);
LRT_TERM(lrt, latest);
LRT_TERM(lrt, queue);
LRT_TERM(lrt, queueLength);
LRT_TERM(lrt, minimumInterval);
LRT_TERM(lrt, query);
LRT_TERM(lrt, session);
LRT_TERM(lrt, secret);
LRT_TERM(lrt, delivered);
LRT_TERM(lrt, dropped);
LRT_TERM(lrt, lastError);
LRT_TERM(lrt, suspended);
LRT_TERM(lrt, confirmed);
LRT_TERM(lrt, datatype);
LRT_TERM(lrt, elementType);
LRT_TERM(lrt, shape);
LRT_TERM(lrt, byteOrder);
LRT_TERM(lrt, littleEndian);
LRT_TERM(lrt, bigEndian);
LRT_TERM(lrt, unavailable);
LRT_TERM(lrt, stop);
LRT_TERM(lrt, StopAction);
LRT_TERM(lrt, stopState);
LRT_TERM(lrt, StopState);
LRT_TERM(lrt, stopped);
LRT_TERM(lrt, stoppedSince);
LRT_TERM(lrt, stoppedBy);
LRT_TERM(lrt, release);
LRT_TERM(lrt, ReleaseAction);
LRT_TERM(lrt, Stopped);
LRT_TERM(lrt, Release);
LRT_TERM(lrt, owner);
LRT_TERM(lrt, role);
LRT_TERM(lrt, Invoke);
LRT_TERM(lrt, Subscribe);
LRT_TERM(lrt, valueFrom);
LRT_TERM(lrt, inputField);
LRT_TERM(lrt, tolerance);
LRT_TERM(lrt, period);
LRT_TERM(lrt, all);
LRT_TERM(lrt, invocationOf);
LRT_TERM(lrt, unreachableSince);
LRT_TERM(lrt, expiresAfter);
LRT_TERM(lrt, control);
LRT_TERM(lrt, Control);
LRT_TERM(lrt, held);
LRT_TERM(lrt, heldBy);
LRT_TERM(lrt, until);
LRT_TERM(lrt, controlRequired);
LRT_TERM(lrt, ControlledByAnother);
LRT_TERM(lrt, ControlRequired);
LRT_TERM(lrt, TakeOver);
LRT_TERM(lrt, structure);
LRT_TERM(lrt, identity);
LRT_TERM(lrt, build);
}  // namespace lrt_

#undef LRT_TERM
#undef LRT_TERM_AS
#undef LRT_VOCAB_rdf
#undef LRT_VOCAB_rdfs
#undef LRT_VOCAB_xsd
#undef LRT_VOCAB_dcterms
#undef LRT_VOCAB_dcat
#undef LRT_VOCAB_ldp
#undef LRT_VOCAB_schema
#undef LRT_VOCAB_prov
#undef LRT_VOCAB_sh
#undef LRT_VOCAB_acl
#undef LRT_VOCAB_foaf
#undef LRT_VOCAB_qudt
#undef LRT_VOCAB_quantitykind
#undef LRT_VOCAB_unit
#undef LRT_VOCAB_hybrit
#undef LRT_VOCAB_vom
#undef LRT_VOCAB_maths
#undef LRT_VOCAB_spatial
#undef LRT_VOCAB_ros
#undef LRT_VOCAB_xhv
#undef LRT_VOCAB_http_core
#undef LRT_VOCAB_http_methods
#undef LRT_VOCAB_sosa
#undef LRT_VOCAB_ssn
#undef LRT_VOCAB_lrt

}  // namespace v0
}  // namespace lrt::vocab
