// SPDX-License-Identifier: Apache-2.0
// What Apache Jena makes of bodies. Run by random_bodies_test.py, which says what is in DIR; input and output are as of random_bodies_node.mjs:
//   java RandomBodies.java DIR
import java.io.StringReader;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.HashMap;
import java.util.Map;

import org.apache.jena.graph.Graph;
import org.apache.jena.graph.Node;
import org.apache.jena.graph.NodeFactory;
import org.apache.jena.graph.Triple;
import org.apache.jena.riot.Lang;
import org.apache.jena.riot.RDFDataMgr;
import org.apache.jena.shacl.Shapes;
import org.apache.jena.shacl.engine.ValidationContext;
import org.apache.jena.shacl.validation.ValidationProc;
import org.apache.jena.sparql.graph.GraphFactory;

class RandomBodies {
  static Graph read(String text) {
    Graph graph = GraphFactory.createGraphMem();
    RDFDataMgr.read(graph, new StringReader(text), null, Lang.NTRIPLES);
    return graph;
  }

  static boolean conforms(Shapes shapes, String shape, String body) {
    Graph data = read(body);
    Triple marker = data.find(Node.ANY, NodeFactory.createURI("urn:focus"), Node.ANY).next();
    data.delete(marker);
    ValidationContext context = ValidationContext.create(shapes, data);
    ValidationProc.execValidateShape(context, data, shapes.getShape(NodeFactory.createURI(shape)), marker.getObject());
    return context.generateReport().conforms();
  }

  public static void main(String[] arguments) throws Exception {
    Path dir = Path.of(arguments[0]);
    Map<String, Shapes> shapes = new HashMap<>();
    StringBuilder out = new StringBuilder();
    for (String block : Files.readString(dir.resolve("bodies.txt")).split("(?m)^= ")) {
      if (block.isEmpty()) continue;
      int end = block.indexOf('\n');
      String[] words = block.substring(0, end).split(" ");
      if (!shapes.containsKey(words[1])) shapes.put(words[1], Shapes.parse(read(Files.readString(dir.resolve(words[1])))));
      String verdict;
      try {
        verdict = conforms(shapes.get(words[1]), words[2], block.substring(end + 1)) ? "1" : "0";
      } catch (Exception e) {
        verdict = e.toString().lines().findFirst().orElse("error");
      }
      out.append(words[0]).append(' ').append(verdict).append('\n');
    }
    System.out.print(out);
  }
}
