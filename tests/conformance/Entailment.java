// SPDX-License-Identifier: Apache-2.0
// What Apache Jena's RDFS reasoner adds to the classes of resources. Run by entailment_test.py: each DIR has the documents of a robot as
// N-Triples, and the report on it begins with "= ".
//   java Entailment.java DIR...
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.HashMap;
import java.util.HashSet;
import java.util.List;
import java.util.Map;
import java.util.Set;
import java.util.TreeMap;
import java.util.TreeSet;
import java.util.stream.Collectors;
import java.util.stream.Stream;

import org.apache.jena.rdf.model.InfModel;
import org.apache.jena.rdf.model.Model;
import org.apache.jena.rdf.model.ModelFactory;
import org.apache.jena.rdf.model.Property;
import org.apache.jena.rdf.model.RDFNode;
import org.apache.jena.rdf.model.Resource;
import org.apache.jena.rdf.model.Statement;
import org.apache.jena.riot.Lang;
import org.apache.jena.riot.RDFDataMgr;
import org.apache.jena.vocabulary.RDF;
import org.apache.jena.vocabulary.RDFS;

class Entailment {
  /// Classes that the axioms of RDF and RDFS give to whatever is a class, a property, a datatype or a list.
  static final Set<Resource> OF_AXIOMS =
      Set.of(RDFS.Resource, RDFS.Class, RDFS.Datatype, RDFS.Literal, RDF.Property, RDFS.ContainerMembershipProperty);

  final Model data = ModelFactory.createDefaultModel();
  InfModel closure;
  final Set<String> wrong = new TreeSet<>();
  final TreeMap<String, Integer> superclasses = new TreeMap<>();
  int nodes, memberships, ofSuperclasses;

  /// The classes of each resource, asked for at once: the reasoner is slow for one after another.
  static Map<Resource, Set<Resource>> classes(Model model) {
    Map<Resource, Set<Resource>> found = new HashMap<>();
    model.listStatements(null, RDF.type, (RDFNode) null).filterKeep(s -> s.getObject().isResource())
        .forEachRemaining(s -> found.computeIfAbsent(s.getSubject(), node -> new HashSet<>()).add(s.getResource()));
    return found;
  }

  boolean isOfAxioms(Resource node, Resource added) {
    if (added.equals(RDF.List)) return node.equals(RDF.nil) || data.contains(node, RDF.first);
    return OF_AXIOMS.contains(added);
  }

  boolean gives(Property predicate, Property kind, Resource added) {
    return closure.listObjectsOfProperty(predicate, RDFS.subPropertyOf).andThen(List.<RDFNode>of(predicate).iterator()).toList().stream()
        .anyMatch(above -> closure.contains(above.asResource(), kind, added));
  }

  /// The triples of the data that give a node a class.
  String reasons(Resource node, Resource added) {
    Set<String> found = new TreeSet<>();
    for (Statement s : data.listStatements(node, null, (RDFNode) null).toList())
      if (gives(s.getPredicate(), RDFS.domain, added)) found.add("as subject of " + s.getPredicate());
    for (Statement s : data.listStatements(null, null, node).toList())
      if (gives(s.getPredicate(), RDFS.range, added)) found.add("as object of " + s.getPredicate());
    return found.isEmpty() ? "by more than one step" : String.join(", ", found);
  }

  void judge(Resource node, Set<Resource> stated, Set<Resource> all) {
    ++nodes;
    memberships += stated.size();
    for (Resource added : all) {
      if (stated.contains(added) || isOfAxioms(node, added)) continue;
      List<Resource> below = stated.stream().filter(c -> closure.contains(c, RDFS.subClassOf, added)).collect(Collectors.toList());
      if (below.isEmpty()) {
        wrong.add((node.isAnon() ? "a blank node" : node.toString()) + " becomes " + added + ", " + reasons(node, added));
      } else {
        ++ofSuperclasses;
        superclasses.merge(below.stream().map(Resource::toString).sorted().collect(Collectors.joining(", ")) + " below " + added, 1, Integer::sum);
      }
    }
  }

  void run(Path dir) throws Exception {
    List<Path> documents;
    try (Stream<Path> all = Files.list(dir)) {
      documents = all.filter(path -> path.toString().endsWith(".nt")).sorted().collect(Collectors.toList());
    }
    for (Path document : documents) RDFDataMgr.read(data, document.toString(), Lang.NTRIPLES);  // blank nodes of each are others
    closure = ModelFactory.createRDFSModel(data);
    Set<Resource> all = data.listSubjects().toSet();
    data.listObjects().filterKeep(RDFNode::isResource).forEachRemaining(node -> all.add(node.asResource()));
    Map<Resource, Set<Resource>> stated = classes(data), inferred = classes(closure);
    for (Resource node : all) judge(node, stated.getOrDefault(node, Set.of()), inferred.getOrDefault(node, Set.of()));
    System.out.printf("= %s: %d documents, %d triples, %d nodes with %d classes stated; %d superclasses are not stated%n", dir.getFileName(),
                      documents.size(), data.size(), nodes, memberships, ofSuperclasses);
    superclasses.forEach((names, count) -> System.out.printf("  %d: %s%n", count, names));
    wrong.forEach(line -> System.out.println("  WRONG: " + line));
  }

  public static void main(String[] arguments) throws Exception {
    for (String dir : arguments) new Entailment().run(Path.of(dir));
  }
}
